"""One placement problem: what is chosen, the logarithm of every hop's SIR, and the rules a chain keeps, all with slopes.

Choices are x, from 0 (transmitter) to SPAN (receiver), relay by relay, then, where altitudes are chosen too, h from 0
(bottom of the band) to SPAN (top). Lengths inside are in units of the link's length. The values alone cost time
proportional to the number of relays, for any number of chains at once (the last axis is a chain); the slopes its square,
for they fill a matrix.
"""

import numpy as np

# How far apart the ends of a choice are. The first step of a quadratic programme is about as long as a slope: with choices
# from 0 to 1 it leaps over the interferer, and the best of six starts of SciPy's SLSQP with 50 relays ended at a twentieth of
# the optimum; from 0 to 10 all six reach it.
SPAN = 10.0

# Two relays in one place have an infinite SIR between them: a square of a distance is never taken as less than this.
LEAST_SQUARE = 1e-18


class Problem:
    """The link, in W, m and 1/m^2, as functions of the choices."""

    def __init__(self, link):
        self.relays = n = link["relays"]
        self.distance_m = d = link["distance_m"]
        self.low_m, self.high_m = link["low_m"], link["high_m"]
        self.chooses_altitudes = self.high_m > self.low_m
        self.choices = 2 * n if self.chooses_altitudes else n
        self.apart = link["min_separation_m"] / d
        self._low, self._high = self.low_m / d, self.high_m / d
        self._x_i, self._y_i = link["x_i"] / d, link["y_i"] / d
        senders = np.full(n, link["relay_w"] * link["eta"] / link["mu_los"])
        senders[0] = link["tx_w"]
        self._hops = np.log(senders / link["interferer_w"])
        at_rx = link["relay_w"] / link["interferer_w"] * link["mu_nlos"] / link["eta"]
        self._last = np.log(at_rx * ((1.0 - self._x_i) ** 2 + self._y_i**2))

    def split(self, choices):
        """The places along the link and the altitudes, in units of its length."""
        shares = np.asarray(choices) / SPAN
        x = shares[..., : self.relays]
        if self.chooses_altitudes:
            return x, self._low + (self._high - self._low) * shares[..., self.relays :]
        return x, np.full_like(x, self._low)

    def in_order(self, choices):
        """The same chain with its places in rising order; altitudes stay with the number of the relay."""
        x, rest = choices[..., : self.relays], choices[..., self.relays :]
        return np.concatenate((np.sort(x), rest), axis=-1)

    def chain(self, choices):
        """[x, h] of every relay in metres, held to the ends of their ranges against rounding."""
        x, h = self.split(choices)
        x_m = np.clip(x * self.distance_m, 0.0, self.distance_m)
        h_m = np.clip(h * self.distance_m, self.low_m, self.high_m)
        return np.column_stack((x_m, h_m)).tolist()

    def worst(self, choices):
        """ln SIR of the worst hop, of one chain or of many."""
        return self._hop_logs(choices)[0].min(axis=-1)

    def ln_sirs(self, choices):
        """ln SIR of the N + 1 hops of a chain, and a row of slopes for each."""
        n, hop = self.relays, np.arange(self.relays)
        logs, near, far, end = self._hop_logs(choices)
        slopes = np.zeros((n + 1, self.choices))
        slopes[hop, hop] = far[1] - near[1]
        slopes[hop[1:], hop[:-1]] = near[1][1:]
        slopes[n, n - 1] = -end[1]
        if self.chooses_altitudes:
            rise = self._high - self._low
            slopes[hop, n + hop] = (far[2] - near[2]) * rise
            slopes[hop[1:], n + hop[:-1]] = near[2][1:] * rise
            slopes[n, 2 * n - 1] = -end[2] * rise
        return logs, slopes / SPAN

    def rules(self, choices):
        """Margins of order and least separation of neighbours, none of which may be negative, and a row of slopes for each.

        N - 1 at a common altitude, where they are one and the same, else 2 (N - 1).
        """
        n, pair = self.relays, np.arange(self.relays - 1)
        x, h = self.split(choices)
        order = np.zeros((n - 1, self.choices))
        order[pair, pair + 1] = 1.0
        order[pair, pair] = -1.0
        if not self.chooses_altitudes:
            return np.diff(x) - self.apart, order / SPAN
        logs, by_x, by_h = _ln_square(np.diff(x), np.diff(h), 0.0)
        by_h = by_h * (self._high - self._low)
        apart = np.zeros((n - 1, self.choices))
        apart[pair, pair + 1] = by_x
        apart[pair, pair] = -by_x
        apart[pair, n + pair + 1] = by_h
        apart[pair, n + pair] = -by_h
        return np.append(np.diff(x), logs - 2.0 * np.log(self.apart)), np.vstack((order, apart)) / SPAN

    def crowding(self, choices):
        """By how much neighbours stand too close, as shares of the least separation, summed: of one chain or of many."""
        x, h = self.split(choices)
        gaps = np.hypot(np.diff(x), np.diff(h))
        return np.maximum(0.0, 1.0 - gaps / self.apart).sum(axis=-1)

    def _hop_logs(self, choices):
        x, h = self.split(choices)
        near = _ln_square(np.diff(x, prepend=0.0), np.diff(h, prepend=0.0), 0.0)
        far = _ln_square(x - self._x_i, h, self._y_i**2)
        end = _ln_square(x[..., -1] - 1.0, h[..., -1], 0.0)
        last = np.expand_dims(self._last - end[0], -1)
        return np.concatenate((self._hops + far[0] - near[0], last), axis=-1), near, far, end


def _ln_square(dx, dh, rest):
    """ln(dx^2 + dh^2 + rest), and its slopes by dx and dh."""
    square = np.maximum(dx * dx + dh * dh + rest, LEAST_SQUARE)
    return np.log(square), 2.0 * dx / square, 2.0 * dh / square


def check_slopes(problem, rng):
    """Raises where a slope differs from what finite differences say: a wrong one would cripple every solver that uses it."""
    choices = problem.in_order(rng.uniform(0.1 * SPAN, 0.9 * SPAN, problem.choices))
    step = 1e-6 * SPAN
    for of in (problem.ln_sirs, problem.rules):
        _, slopes = of(choices)
        for column, unit in enumerate(np.eye(problem.choices)):
            found = (of(choices + step * unit)[0] - of(choices - step * unit)[0]) / (2.0 * step)
            if not np.allclose(slopes[:, column], found, rtol=1e-4, atol=1e-4):
                raise ArithmeticError(f"{of.__name__}: the slopes by choice {column} are wrong")
