"""Symmetric compositions: several symmetric steps of order 2 with different lengths form one step of higher order."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from itertools import accumulate
from typing import NamedTuple

from ...check import choice, describe
from ...errors import BadInput


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
    "one_step": Composition(2, "the step itself", "1"),
    "forest_ruth_3": Composition(
        4,
        "Forest & Ruth 1990; Yoshida 1990",
        "1.351207191959657634047687808971460826922 -1.702414383919315268095375617942921653844",
    ),
    "suzuki_5": Composition(
        4,
        "Suzuki 1990",
        "0.414490771794375737142354062860761495711775 0.414490771794375737142354062860761495711775 "
        "-0.657963087177502948569416251443045982847098",
    ),
    "mclachlan_5": Composition(
        4,
        "McLachlan 1995",
        "0.280000000000000000007541375864594412990231 0.625466428467670044995942535032658194429876 "
        "-0.810932856935340090006967821794505214840213",
    ),
    "yoshida_7": Composition(
        6,
        "Yoshida 1990, solution A",
        "0.784513610477557263819497633866349875776824 0.235573213359358133684793182978534601686468 "
        "-1.17767998417887100694641568096431573463927 1.31518632068391121888424972823886251435195",
    ),
    "kahan_li_9": Composition(
        6,
        "Kahan & Li 1997, s9odr6a",
        "0.392161444007314139279250557422671403804934 0.332599136789359438599748637500049646881587 "
        "-0.706246172557639359809964819549256459395511 0.0822135962935508002314904481020563311032939 "
        "0.798543990934829963398950353048958155211391",
    ),
    "kahan_li_17": Composition(
        8,
        "Kahan & Li 1997, s17odr8a",
        "0.130202483088890080878817632096700522357247 0.561162981775108384561964407700150567266159 "
        "-0.389474962644847286408078598235248388836068 0.158841906555155600896210745707152481412148 "
        "-0.395903894133237577336231539347938936026771 0.184539640978315707091832541533375462818987 "
        "0.258374387686322047293979109994939471813076 0.295011723609310298870966240218228112976543 "
        "-0.605508533830034511698921079334718587562643",
    ),
    "suzuki_umeno_15": Composition(
        8,
        "Suzuki & Umeno 1993",
        "0.741670364350612953448227801783806315603537 -0.409100825800031593997300095893563417309918 "
        "0.190754710296238379953876256450371662735461 -0.573862471116082266656387726635535742159509 "
        "0.299064181303655923844463540688602988225823 0.334624918245298183784957979882182288633692 "
        "0.315293092396766596632056663811002430994081 -0.796887939352916354019788840173733053446332",
    ),
    "mclachlan_17": Composition(
        8,
        "McLachlan 1995",
        "0.128865979381443298964879690876529454482711 0.581514087105250962431063963983883229745653 "
        "-0.410175371469850137522334264124239383661725 0.18514693571658773265708609123693157145807 "
        "-0.409552343420851419349845989192841890740444 0.144405941080012041060700442457951460000218 "
        "0.278335500393679651314353242840553652005516 0.314956683916294857884378740326278311770834 "
        "-0.626994825405133974880563836810092810121667",
    ),
    "hairer_lubich_wanner_33": Composition(
        10,
        "Hairer, Lubich & Wanner 2006, V.3.2",
        "0.0904061936860727849216115009321603218120353 0.535918159530301202137849834402254494805461 "
        "0.351232575474939781875177357509412017124556 -0.311168020978158354260865436152122756621733 "
        "-0.525563141942635104310655492066121201174012 0.1444790941022524764734569508824333353042 "
        "0.0298358860974823581806408310014178787552497 0.17786179923739805133592238438956525976662 "
        "0.0982690693934163765253237718721641234824302 0.461799862104118608732421262875323616898409 "
        "-0.333778455998818513145318196284593283309177 0.0709568483652479362103115206193587611284439 "
        "0.236669600701268687719098193794445808817549 -0.497259779506609854450283876883036844524718 "
        "-0.30399616617237257346546355724557956882626 0.0524695718810006957452161236802525824715398 "
        "0.443733808050190879551113653345330908178812",
    ),
    "sofroniou_spaletta_35": Composition(
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
}
"""All sets by name."""

BEST = {2: "one_step", 4: "suzuki_5", 6: "kahan_li_9", 8: "kahan_li_17", 10: "sofroniou_spaletta_35"}
"""The set of each order that is most accurate at equal cost, measured on the brick and on a generic heavy top."""


def composition_of(order: int, name: str | None = None) -> Composition:
    """Return the set called `name`, or the best one of the order.

    Raise `BadInput` if there is no set of this order, or none of this name that has this order.
    """
    choice("order", order, tuple(BEST))
    allowed = [known for known in COMPOSITIONS if COMPOSITIONS[known].order == order]
    if name is not None and not (isinstance(name, str) and name in allowed):
        raise BadInput("composition", describe(name), f"None or, of order {order}, one of " + ", ".join(allowed))
    return COMPOSITIONS[BEST[order] if name is None else name]


OUTSIDE = "stages of its composition are outside of the step, where a function of time may have no value"


def leaves_step(weights: Iterable[Fraction]) -> bool:
    """Return whether stages of such lengths, relative to the step, begin before it or end after it."""
    return not all(0 <= end < 1 + 1e-12 for end in accumulate(weights))
