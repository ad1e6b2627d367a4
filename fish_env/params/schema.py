"""A fish: every number of the model, frozen and checked, with unit, bounds, origin and prior."""

import dataclasses
from collections.abc import Mapping

from fish_env.arrays import FloatArray
from fish_env.errors import ParameterError
from fish_env.params import checks, prior, trees
from fish_env.params.fields import Leaf, as_number, leaves, tables
from fish_env.params.fish_data import FishData
from fish_env.params.provenance import Status
from fish_env.params.tables import CoefficientTable


@dataclasses.dataclass(frozen=True)
class ParameterInfo:
    """Everything known about one parameter.

    Attributes:
        path: Dotted path in the parameter file, list items as `[i]`.
        value: Value in the unit below.
        unit: SI unit, "-" for a pure number.
        lower: Smallest value that is physically possible.
        upper: Largest plausible value.
        status: `published`, `reconstructed` or `identified`.
        source: Where the value comes from, in words.
        prior_sd: Standard deviation of the prior in the same unit, see `FishParams.prior_sd`.
        symbol: Symbol in the model's equations.
        description: One line in plain words.
    """

    path: str
    value: float
    unit: str
    lower: float
    upper: float
    status: Status
    source: str
    prior_sd: float
    symbol: str
    description: str


@dataclasses.dataclass(frozen=True)
class FishParams(FishData):
    """The parameters of one fish.

    Two fish are equal when all their numbers, tables, effects and origins are, whatever file they
    came from. Construction checks everything; use `dataclasses.replace` or `replace` for changes.

    Attributes:
        name: Name of the fish.
        effects: Effects switched on in the file, parameter values by effect name. Which effects
            exist is for the effects registry to say; here they are names and finite numbers.
        provenance: Status and source of every value.
        posterior: What an identification found, carried by extended models.
        source_file: File the fish was read from; None for one made in Python.
        trust_effects: Whether effect files beside that file may be run. Only a caller says so,
            never a file.

    Raises:
        ParameterError: A value is impossible; names the file, the key and the remedy.
    """

    def __post_init__(self) -> None:
        checks.check_fish(self)

    def values(self) -> dict[str, float]:
        """Returns every number of the model by path, in file order, without the prior.

        Coefficients that a table replaces are left out; see `tables`.
        """
        return {leaf.path: leaf.value for leaf in leaves(self)}

    def tables(self) -> dict[str, CoefficientTable]:
        """Returns the coefficient tables by the path of the curve they replace, `tail.drag`."""
        return dict(tables(self))

    def get(self, path: str) -> float:
        """Returns the number at a path.

        Raises:
            ParameterError: No parameter has this path; names the closest one.
        """
        value: float = self._leaf(path).value
        return value

    def replace(
        self,
        values: Mapping[str, float],
        status: Status | None = None,
        source: str | None = None,
    ) -> "FishParams":
        """Returns a copy with other values.

        Args:
            values: New number by path.
            status: Status of the new values; None keeps what was said of the old ones.
            source: Source of the new values; None keeps what was said of the old ones.

        Raises:
            ParameterError: A path is unknown, or the copy would not be a possible fish.
        """
        known = {leaf.path for leaf in leaves(self)}
        for path in values:
            if path not in known:
                self._leaf(path)
        floats = {path: as_number(value) for path, value in values.items()}
        changes = trees.replaced_groups(self, floats)
        provenance = self.provenance.updated(values, status, source)
        return dataclasses.replace(self, **changes, provenance=provenance)

    def info(self, path: str) -> ParameterInfo:
        """Returns everything known about the parameter at a path.

        Raises:
            ParameterError: No parameter has this path; names the closest one.
        """
        leaf, origin = self._leaf(path), self.provenance.of(path)
        return ParameterInfo(
            path=path,
            value=leaf.value,
            unit=leaf.spec.unit,
            lower=leaf.spec.lower,
            upper=leaf.spec.upper,
            status=origin.status,
            source=origin.source,
            prior_sd=prior.standard_deviation(self, leaf),
            symbol=trees.symbol_of(leaf),
            description=leaf.spec.description,
        )

    def prior_sd(self, path: str) -> float:
        """Returns how far a parameter may be off, one standard deviation in its own unit.

        The prior of the file is relative. Static moments use that of the geometry times the mass
        times 0.1 m. The buoyancy is trimmed against the scales, so its value is given the mass:
        0.0002 kg; a moved mass must carry the buoyancy along, see `prior_covariance`. Water and
        gravity are known, 0, as is a length of exactly 0, which says on the plane of symmetry.

        Raises:
            ParameterError: No parameter has this path; names the closest one.
        """
        return prior.standard_deviation(self, self._leaf(path))

    def prior_covariance(self, paths: list[str]) -> FloatArray:
        """Returns the prior covariance of several parameters, shape (n, n), in their own units.

        It is diagonal but for mass and buoyancy, which move together: their difference is known
        far better than either.

        Raises:
            ParameterError: No parameter has one of the paths; names the closest one.
        """
        return prior.covariance(self, [self._leaf(path) for path in paths])

    def _leaf(self, path: str) -> Leaf:
        for leaf in leaves(self):
            if leaf.path == path:
                return leaf
        raise ParameterError(checks.unknown_path(self, path))
