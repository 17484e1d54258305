"""Writing lines of G-code: lengths in mm, feeds in mm/min, spindle in rpm or laser in S units."""

ABSOLUTE_MM = "G21 G90 G94 G17"  # mm, absolute, mm/min, XY plane: a job must not trust what was set before it
SAFE_Z = 2.0  # mm above the surface, for rapids


def number(value):
    """Writes a number with at most three decimals (1 um); never an exponent, never `-0`."""
    text = f"{value:.3f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def block(code="", **words):
    """Joins a code and its words in the order given: `block("G1", x=2, f=300)` is `G1 X2 F300`."""
    return " ".join(filter(None, [code, *(name.upper() + number(value) for name, value in words.items())]))


def comment(*sentences):
    """Puts each sentence on a line of its own, in parentheses, as every version of Grbl accepts them."""
    return [f"({sentence})" for sentence in sentences]
