"""Hover or fly: the distance from which forward flight costs less, predicted and flown."""
