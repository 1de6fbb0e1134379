"""Elementary functions with bit-identical results on every machine, for all results of runs.

IEEE 754 fixes + - * / and the square root to the last bit, but not exp, log, sin and the like, whose last bit depends
on library, version and processor. These functions use the former alone, in a fixed order; tables come from integer
arithmetic. Powers are products, lengths are square roots of sums of squares, sums of many floats are ``math.fsum``.

Maximum errors in units in the last place: exp 0.6, expm1 3.0, log 0.8, log1p 1.5, log10 2.5, power_of_10 3.5,
sine 2.5, cosine 2.5, atan2 1.6, length 1.2, erfc 6.0, normal_quantile 6.0, as found at 100,000 random arguments each
against 40 digits, rounded up. Arguments outside the domain raise ``ValueError``.
"""

from collections.abc import Iterable, Sequence
from math import copysign, fabs, floor, frexp, fsum, inf, isnan, isqrt, ldexp, sqrt

_BITS = 160
"""Binary places of the fixed-point numbers behind the tables."""
_ONE = 1 << _BITS


def _split(number: int) -> tuple[float, float]:
    """Split a fixed-point number into a float and its small remainder."""
    high = number / _ONE  # a quotient of whole numbers is rounded once
    upper, lower = high.as_integer_ratio()
    return high, (number - upper * _ONE // lower) / _ONE


def _trimmed(number: int, *bits: int) -> tuple[float, ...]:
    """Split it into floats, of which all but the last have the given numbers of binary places."""
    parts = []
    for places in bits:
        part = number >> _BITS - places << _BITS - places
        parts.append(part / _ONE)
        number -= part
    return *parts, number / _ONE


def _arctangent(top: int, bottom: int) -> int:
    """Arctangent of a fraction below 1, by its power series."""
    term, square, total, number = (top << _BITS) // bottom, bottom * bottom, 0, 1
    while term:
        total += term // number if number % 4 == 1 else -(term // number)
        term, number = term * top * top // square, number + 2
    return total


def _whole_log_2() -> int:
    term, total, number = (2 << _BITS) // 3, 0, 1
    while term:
        total += term // number
        term, number = term // 9, number + 2
    return total


def _whole_roots_of_2(halvings: int) -> list[int]:
    """Powers of 2 with exponents 0 to below 1, in steps of 2^-halvings."""
    roots = [_ONE]
    for step in range(1, halvings + 1):
        root = 2 << _BITS
        for _ in range(step):
            root = isqrt(root << _BITS)
        roots = [new for old in roots for new in (old, old * root >> _BITS)]
    return roots


_WHOLE_PI = 16 * _arctangent(1, 5) - 4 * _arctangent(1, 239)  # Machin
PI, _PI_LOW = _split(_WHOLE_PI)
TAU = 2.0 * PI
_HALF_PI, _HALF_PI_LOW = 0.5 * PI, 0.5 * _PI_LOW
_TURN_1, _TURN_2, _TURN_3 = _trimmed(_WHOLE_PI >> 1, 32, 64)
_LN2_HIGH, _LN2_LOW = _trimmed(_whole_log_2(), 32)
LN2, _ = _split(_whole_log_2())

# 2^(j / 32) and its rest; exp needs a series within 1 / 64 of such a power only.
_PARTS = 32
_ROOTS = tuple(_split(root) for root in _whole_roots_of_2(5))
_PER_PART = _PARTS / LN2
_PART_HIGH, _PART_LOW = _LN2_HIGH / _PARTS, _LN2_LOW / _PARTS
_LARGEST, _SMALLEST = 709.782712893384, -745.1332191019412
"""Arguments beyond which exp overflows, or is 0."""

_SECTORS = 64
_ARCTANGENTS = [(0.0, 0.0)]
_whole = 0
for _sector in range(1, _SECTORS + 1):  # atan b = atan a + atan (b - a) / (1 + a b)
    _whole += _arctangent(_SECTORS, _SECTORS * _SECTORS + _sector * (_sector - 1))
    _ARCTANGENTS.append(_split(_whole))


def exp(x: float) -> float:
    """Exponential: exp x = 2^(n / 32) (1 + q), q = exp r - 1, remainder r of x below log 2 / 64.

    >>> exp(0.0), exp(-float("inf")), exp(1.0)
    (1.0, 0.0, 2.718281828459045)
    """
    if not _SMALLEST <= x <= _LARGEST:
        return inf if x > 0.0 else 0.0 if x < 0.0 else x
    number = floor(x * _PER_PART + 0.5)
    r = (x - number * _PART_HIGH) - number * _PART_LOW
    q = r + r * r * (0.5 + r * (1 / 6 + r * (1 / 24 + r * (1 / 120 + r * (1 / 720)))))
    high, low = _ROOTS[number % _PARTS]
    return ldexp(high + (low + high * q), number // _PARTS)


def expm1(x: float) -> float:
    """Return exp x - 1, accurate for small arguments too.

    >>> expm1(0.0), expm1(1e-20), expm1(-float("inf"))
    (0.0, 1e-20, -1.0)
    """
    return expm1_of((x,))[0]


def expm1_of(numbers: Iterable[float]) -> list[float]:
    """Return ``expm1`` of many numbers, faster than one by one."""
    values = []
    for x in numbers:
        if not -40.0 <= x <= 700.0:
            values.append(-1.0 if x < 0.0 else exp(x))
            continue
        number = floor(x * _PER_PART + 0.5)
        r = (x - number * _PART_HIGH) - number * _PART_LOW
        q = r + r * r * (0.5 + r * (1 / 6 + r * (1 / 24 + r * (1 / 120 + r * (1 / 720)))))
        if number == 0:
            values.append(q)
            continue
        high, low = _ROOTS[number % _PARTS]
        power = number // _PARTS
        high = ldexp(high, power)
        values.append((high - 1.0) + (ldexp(low, power) + high * q))
    return values


def log(x: float) -> float:
    """Natural logarithm.

    With x = 2^e (1 + f) and s = f / (2 + f), log (1 + f) = 2 artanh s = f - f^2 / 2 + s (f^2 / 2 + R), where R is the
    series of artanh without its first term, over s.

    >>> log(1.0), log(float("inf")), log(4.0) / log(2.0)
    (0.0, inf, 2.0)
    """
    if not 0.0 < x < inf:
        if x == inf or isnan(x):
            return x
        raise ValueError(f"logarithm of {x}: above 0 expected")
    mantissa, e = frexp(x)
    if mantissa < 0.7071067811865476:
        mantissa, e = 2.0 * mantissa, e - 1
    # The mantissa is within the square roots of 1/2 and 2, where f is smallest and the series shortest.
    f = mantissa - 1.0
    s = f / (2.0 + f)
    z = s * s
    series = 2 / 13 + z * (2 / 15 + z * (2 / 17 + z * (2 / 19 + z * (2 / 21 + z * (2 / 23)))))
    series = z * (2 / 3 + z * (2 / 5 + z * (2 / 7 + z * (2 / 9 + z * (2 / 11 + z * series)))))
    half = 0.5 * f * f
    return e * _LN2_HIGH - ((half - (s * (half + series) + e * _LN2_LOW)) - f)


def log1p(x: float) -> float:
    """Return log (1 + x), accurate for small arguments too.

    >>> log1p(0.0), log1p(1e-20)
    (0.0, 1e-20)
    """
    near = 1.0 + x
    if near in (1.0, inf):
        return x
    return log(near) + (x - (near - 1.0)) / near  # rounding error of the sum, to first order


LN10 = log(10.0)


def log10(x: float) -> float:
    """Decimal logarithm."""
    return log(x) / LN10


def power_of_10(x: float) -> float:
    """Return 10 to the power of x: the ratio of a level of 10 x decibels.

    >>> power_of_10(3.0), power_of_10(-2.0)
    (1000.0, 0.01)
    """
    whole = floor(x + 0.5)
    # Python converts decimal text with correct rounding.
    return float(f"1e{whole}") * exp((x - whole) * LN10)


def power(base: float, n: int) -> float:
    """Return a base to the power of an integer >= 0, by repeated squaring.

    >>> power(3.0, 5), power(0.5, 0)
    (243.0, 1.0)
    """
    result = 1.0
    while n:
        if n & 1:
            result *= base
        base, n = base * base, n >> 1
    return result


def sincos(x: float) -> tuple[float, float]:
    """Sine and cosine of an angle (rad) up to 6.5e6 in magnitude.

    >>> sincos(0.0), sincos(PI)[1]
    ((0.0, 1.0), -1.0)
    """
    if not -6.5e6 < x < 6.5e6:
        raise ValueError(f"angle of {x} rad: at most 6.5e6 expected")
    # The first parts have few digits, so that their products with a whole number are exact (Cody and Waite).
    quarters = floor(x / _HALF_PI + 0.5)
    r = ((x - quarters * _TURN_1) - quarters * _TURN_2) - quarters * _TURN_3
    z = r * r
    series = 1 / 362880 - z * (1 / 39916800 - z * (1 / 6227020800 - z * (1 / 1307674368000 - z / 355687428096000)))
    sine = r - r * z * (1 / 6 - z * (1 / 120 - z * (1 / 5040 - z * series)))
    series = 1 / 40320 - z * (1 / 3628800 - z * (1 / 479001600 - z * (1 / 87178291200 - z / 20922789888000)))
    cosine = 1.0 - z * (0.5 - z * (1 / 24 - z * (1 / 720 - z * series)))
    match quarters & 3:
        case 0:
            return sine, cosine
        case 1:
            return cosine, -sine
        case 2:
            return -sine, -cosine
        case _:
            return -cosine, sine


def atan2(y: float, x: float) -> float:
    """Angle (rad) of a vector (x, y), in [-pi, pi].

    >>> atan2(0.0, 1.0), atan2(1.0, 0.0) == PI / 2.0, atan2(0.0, -1.0) == PI, atan2(-1.0, -1.0) == -0.75 * PI
    (0.0, True, True, True)
    """
    high, low = fabs(x), fabs(y)
    is_steep = low > high
    if is_steep:
        high, low = low, high
    if not 1e-290 < high < 1e300:
        if high == 0.0:
            return copysign(PI if copysign(1.0, x) < 0.0 else 0.0, y)
        high, low = _scaled(high, low)
    sector = int(low / high * _SECTORS + 0.5)
    near = sector / _SECTORS
    t = (low - near * high) / (high + near * low)
    z = t * t
    of_sector, rest = _ARCTANGENTS[sector]
    angle = of_sector + (rest + (t - t * z * (1 / 3 - z * (1 / 5 - z * (1 / 7)))))
    if is_steep:
        angle = (_HALF_PI + (angle if x < 0.0 else -angle)) + _HALF_PI_LOW
    elif x < 0.0:
        angle = (PI - angle) + _PI_LOW
    return copysign(angle, y)


def _scaled(high: float, low: float) -> tuple[float, float]:
    """Scale two numbers by one factor away from overflow and underflow."""
    if high == inf:
        return 1.0, float(low == inf)
    by = -700 if high > 1.0 else 700
    return ldexp(high, by), ldexp(low, by)


def distance(point: Sequence[float], other: Sequence[float]) -> float:
    """Distance of two points in the plane; squares must neither overflow nor underflow.

    >>> distance((0.0, 1.0), (3.0, 5.0))
    5.0
    """
    dx, dy = point[0] - other[0], point[1] - other[1]
    return sqrt(dx * dx + dy * dy)


def length(x: float, y: float) -> float:
    """Length of a vector in the plane; squares must neither overflow nor underflow.

    >>> length(3.0, -4.0)
    5.0
    """
    return sqrt(x * x + y * y)


_STEP = 0.5
_NODES = tuple((number * _STEP) * (number * _STEP) for number in range(1, 14))
_HEIGHTS = tuple(exp(-square) for square in _NODES)


def erfc(x: float) -> float:
    """Complementary error function.

    Series below 0.5; beyond, trapezoidal rule for its integral in the complex plane with the residue of its pole
    (Chiarella and Reichel, Mathematics of Computation 22 (1968), 137-143).

    >>> erfc(0.0), erfc(float("inf")), erfc(-float("inf"))
    (1.0, 0.0, 2.0)
    """
    if x < 0.0:
        return 2.0 - erfc(-x)
    if isnan(x):
        return x
    square = x * x
    if x < 0.5:
        term, total = x, x
        for number in range(1, 14):
            term *= -square / number
            total += term / (2 * number + 1)
        return 1.0 - 2.0 / sqrt(PI) * total
    # Below the smallest number above 0.
    if x > 27.3:
        return 0.0
    short = floor(x * 1048576.0) / 1048576.0  # its square is exact
    height = exp(-short * short) * exp(-(x - short) * (x + short))
    total = fsum(weight / (node + square) for node, weight in zip(_NODES, _HEIGHTS, strict=True))
    value = _STEP * x / PI * height * (1.0 / square + 2.0 * total)
    return value - 2.0 / expm1(TAU * x / _STEP) if x < PI / _STEP else value


_CENTRAL = (
    (2.5090809287301226727e3, 3.3430575583588128105e4, 6.7265770927008700853e4, 4.5921953931549871457e4,
     1.3731693765509461125e4, 1.9715909503065514427e3, 1.3314166789178437745e2, 3.3871328727963666080e0),
    (5.2264952788528545610e3, 2.8729085735721942674e4, 3.9307895800092710610e4, 2.1213794301586595867e4,
     5.3941960214247511077e3, 6.8718700749205790830e2, 4.2313330701600911252e1, 1.0),
)  # fmt: skip
_MIDDLE = (
    (7.74545014278341407640e-4, 2.27238449892691845833e-2, 2.41780725177450611770e-1, 1.27045825245236838258e0,
     3.64784832476320460504e0, 5.76949722146069140550e0, 4.63033784615654529590e0, 1.42343711074968357734e0),
    (1.05075007164441684324e-9, 5.47593808499534494600e-4, 1.51986665636164571966e-2, 1.48103976427480074590e-1,
     6.89767334985100004550e-1, 1.67638483018380384940e0, 2.05319162663775882187e0, 1.0),
)  # fmt: skip
_FAR = (
    (2.01033439929228813265e-7, 2.71155556874348757815e-5, 1.24266094738807843860e-3, 2.65321895265761230930e-2,
     2.96560571828504891230e-1, 1.78482653991729133580e0, 5.46378491116411436990e0, 6.65790464350110377720e0),
    (2.04426310338993978564e-15, 1.42151175831644588870e-7, 1.84631831751005468180e-5, 7.86869131145613259100e-4,
     1.48753612908506148525e-2, 1.36929880922735805310e-1, 5.99832206555887937690e-1, 1.0),
)  # fmt: skip


def _ratio(quotient: tuple[tuple[float, ...], tuple[float, ...]], x: float) -> float:
    """Quotient of two polynomials, highest powers first."""
    top = bottom = 0.0
    for upper, lower in zip(*quotient, strict=True):
        top, bottom = top * x + upper, bottom * x + lower
    return top / bottom


def normal_quantile(share: float) -> float:
    """Standard normal quantile (Wichura, Applied Statistics 37 (1988), 477-484).

    ``share`` is a probability above 0 and below 1.

    >>> normal_quantile(0.5), round(normal_quantile(0.975), 6)
    (0.0, 1.959964)
    """
    if not 0.0 < share < 1.0:
        raise ValueError(f"quantile of {share}: above 0 and below 1 expected")
    off = share - 0.5
    if fabs(off) <= 0.425:
        return off * _ratio(_CENTRAL, 0.180625 - off * off)
    root = sqrt(-log(share if off < 0.0 else 1.0 - share))
    value = _ratio(_MIDDLE, root - 1.6) if root <= 5.0 else _ratio(_FAR, root - 5.0)
    return -value if off < 0.0 else value
