"""Nu against nu' on the quadrotor, where the law's model is exact."""

from sitl.lab.reproduction.experiments import nu_redefinition


def test_nu_prime_alone_makes_the_force_error_a_first_order_lag():
    lag = {
        prime: nu_redefinition.lag_error(nu_redefinition.lift(nu_prime=prime, duration=3.0)) for prime in (False, True)
    }
    assert lag[True] < 0.01
    assert lag[False] > 0.05
