"""Symmetric compositions: several symmetric steps of order 2 with different lengths form one step of higher order."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

from ...check import choice


class Composition(NamedTuple):
    """Even order and publication of a composition of symmetric steps of order 2, and the first half of its lengths.

    `half` has decimals, with more digits than a double, of the lengths of the first stages relative to the step, up to and
    including the middle one; the rest mirrors them. Tests check the order conditions and measure the order.
    """

    order: int
    source: str
    half: str

    @property
    def weights(self) -> tuple[Fraction, ...]:
        """Lengths of all stages relative to the step: the exact values of the decimals."""
        first = tuple(Fraction(text) for text in self.half.split())
        return first + first[-2::-1]

    @property
    def stages(self) -> int:
        """Number of stages."""
        return 2 * len(self.half.split()) - 1

    def lengths(self, dt: float) -> tuple[float, ...]:
        """Return the lengths of the stages, s, of a step dt, s.

        Each is rounded once, from the exact product. The middle one is the remainder of dt, so that rounding errors do not
        accumulate.
        """
        rounded = [float(w * Fraction(dt)) for w in self.weights]
        middle = self.stages // 2
        others = sum(Fraction(length) for k, length in enumerate(rounded) if k != middle)
        rounded[middle] = float(Fraction(dt) - others)
        return tuple(rounded)


COMPOSITIONS = {
    composition.order: composition
    for composition in (
        Composition(2, "the step itself", "1"),
        Composition(
            4,
            "Suzuki 1990",
            "0.414490771794375737142354062860761495711775 0.414490771794375737142354062860761495711775 "
            "-0.657963087177502948569416251443045982847098",
        ),
        Composition(
            6,
            "Kahan & Li 1997, s9odr6a",
            "0.392161444007314139279250557422671403804934 0.332599136789359438599748637500049646881587 "
            "-0.706246172557639359809964819549256459395511 0.0822135962935508002314904481020563311032939 "
            "0.798543990934829963398950353048958155211391",
        ),
        Composition(
            8,
            "Kahan & Li 1997, s17odr8a",
            "0.130202483088890080878817632096700522357247 0.561162981775108384561964407700150567266159 "
            "-0.389474962644847286408078598235248388836068 0.158841906555155600896210745707152481412148 "
            "-0.395903894133237577336231539347938936026771 0.184539640978315707091832541533375462818987 "
            "0.258374387686322047293979109994939471813076 0.295011723609310298870966240218228112976543 "
            "-0.605508533830034511698921079334718587562643",
        ),
        Composition(
            10,
            "Sofroniou & Spaletta 2005",
            "0.0787957225216864192639076793383782352877653 0.313096103415108527764812471919375119427788 "
            "0.0279183832350780661095202732646229631648935 -0.229592841593907094151213396801772333759619 "
            "0.130962061077164863174656859293939635912993 -0.269733405654510714344609732216317792089151 "
            "0.0749733431558914356661371056387287990291454 0.111993423999810204889575080737386917384281 "
            "0.366133449546226751193148123537947805939005 -0.399105630136035897878629810584101969653898 "
            "0.103087398527471077315802769991778382274162 0.411430873955890237820704118977676163371669 "
            "-0.00486636058313526176219565930742547587096462 -0.392033353708639906448081936430529864761924 "
            "0.0519425029624496470371829049273376385168948 0.0506650907599244963358743424008435193510213 "
            "0.0496743706397298790545688003948408097700571 0.0493177357595945379176800098345828934117586",
        ),
    )
}
"""The set of each order that is most accurate at equal cost, measured on the brick and on a generic heavy top.

Less accurate were three stages of Forest & Ruth (1990) and five of McLachlan (1995) for order 4, seven of Yoshida (1990) for
order 6, fifteen of Suzuki & Umeno (1993) and seventeen of McLachlan for order 8, and 33 of Hairer, Lubich & Wanner (2006) for
order 10. Some of them have stages outside of the step, where a function of time may have no value.
"""

COMPOSED = "settings without composition: each order has its most accurate one"


def composition_of(order: int) -> Composition:
    """Return the set of an order. Raise `BadInput` if there is none."""
    choice("order", order, tuple(COMPOSITIONS))
    return COMPOSITIONS[order]
