"""One placement problem: what is chosen, the logarithm of every hop's SIR, and the rules a chain keeps, all with slopes.

Choices are x, from 0 (transmitter) to SPAN (receiver), relay by relay; then, where there is room to the side, y from 0 (left
end of the room) to SPAN (right end); then, where altitudes are chosen, h from 0 (bottom of the band) to SPAN (top). Lengths inside are in units of the link's length. The values alone cost time
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
        # Low and high ends of x, y and h, m.
        self.ends_m = (
            (0.0, d),
            (link["left_m"], link["right_m"]),
            (link["low_m"], link["high_m"]),
        )
        # Which of them are chosen, by number, and how much each grows over a whole choice.
        self.axes = [axis for axis, (low, high) in enumerate(self.ends_m) if high > low]
        self.rise = [(self.ends_m[axis][1] - self.ends_m[axis][0]) / d / SPAN for axis in self.axes]
        self.choices = len(self.axes) * n
        self.apart = link["min_separation_m"] / d
        self._x_i, self._y_i = link["x_i"] / d, link["y_i"] / d
        senders = np.full(n, link["relay_w"] * link["eta"] / link["mu_los"])
        senders[0] = link["tx_w"]
        self._hops = np.log(senders / link["interferer_w"])
        at_rx = link["relay_w"] / link["interferer_w"] * link["mu_nlos"] / link["eta"]
        self._last = np.log(at_rx * ((1.0 - self._x_i) ** 2 + self._y_i**2))

    def split(self, choices):
        """x, y and h of every relay, in units of the link's length."""
        n, choices = self.relays, np.asarray(choices)
        places = [np.full_like(choices[..., :n], low / self.distance_m) for low, _ in self.ends_m]
        for block, (axis, rise) in enumerate(zip(self.axes, self.rise)):
            places[axis] = places[axis] + rise * choices[..., block * n : (block + 1) * n]
        return places

    def in_order(self, choices):
        """The same chain with its places in rising order; sides and altitudes stay with the number of the relay."""
        x, rest = choices[..., : self.relays], choices[..., self.relays :]
        return np.concatenate((np.sort(x), rest), axis=-1)

    def chain(self, choices):
        """[x, y, h] of every relay in metres, held to the ends of their ranges against rounding."""
        places = zip(self.split(choices), self.ends_m)
        return np.column_stack([np.clip(place * self.distance_m, *ends) for place, ends in places]).tolist()

    def worst(self, choices):
        """ln SIR of the worst hop, of one chain or of many."""
        return self._hop_logs(choices)[0].min(axis=-1)

    def ln_sirs(self, choices):
        """ln SIR of the N + 1 hops of a chain, and a row of slopes for each."""
        n, hop = self.relays, np.arange(self.relays)
        logs, near, far, end = self._hop_logs(choices)
        slopes = np.zeros((n + 1, self.choices))
        for block, (axis, rise) in enumerate(zip(self.axes, self.rise)):
            by_far, by_near, by_end = far[1][axis], near[1][axis], end[1][axis]
            first = block * n
            slopes[hop, first + hop] = rise * (by_far - by_near)
            slopes[hop[1:], first + hop[:-1]] = rise * by_near[1:]
            slopes[n, first + n - 1] = -rise * by_end
        return logs, slopes

    def rules(self, choices):
        """Margins of order and least separation of neighbours, none of which may be negative, and a row of slopes for each.

        N - 1 where x alone is chosen, where they are one and the same, else 2 (N - 1).
        """
        n, pair = self.relays, np.arange(self.relays - 1)
        gaps = [np.diff(place) for place in self.split(choices)]
        order = np.zeros((n - 1, self.choices))
        order[pair, pair + 1] = self.rise[0]
        order[pair, pair] = -self.rise[0]
        if len(self.axes) == 1:
            return gaps[0] - self.apart, order
        logs, by = _ln_square(*gaps)
        apart = np.zeros((n - 1, self.choices))
        for block, (axis, rise) in enumerate(zip(self.axes, self.rise)):
            apart[pair, block * n + pair + 1] = rise * by[axis]
            apart[pair, block * n + pair] = -rise * by[axis]
        return np.append(gaps[0], logs - 2.0 * np.log(self.apart)), np.vstack((order, apart))

    def crowding(self, choices):
        """By how much neighbours stand too close, as shares of the least separation, summed: of one chain or of many."""
        squares = sum(np.diff(place) ** 2 for place in self.split(choices))
        return np.maximum(0.0, 1.0 - np.sqrt(squares) / self.apart).sum(axis=-1)

    def _hop_logs(self, choices):
        x, y, h = self.split(choices)
        near = _ln_square(*(np.diff(place, prepend=0.0) for place in (x, y, h)))
        far = _ln_square(x - self._x_i, y - self._y_i, h)
        end = _ln_square(x[..., -1] - 1.0, y[..., -1], h[..., -1])
        last = np.expand_dims(self._last - end[0], -1)
        return np.concatenate((self._hops + far[0] - near[0], last), axis=-1), near, far, end


def _ln_square(dx, dy, dh):
    """ln(dx^2 + dy^2 + dh^2), and its slopes by the three."""
    square = np.maximum(dx * dx + dy * dy + dh * dh, LEAST_SQUARE)
    return np.log(square), (2.0 * dx / square, 2.0 * dy / square, 2.0 * dh / square)


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
