"""The proof of the linear hover law: inequalities, what they cover, and the certificates that were found."""
