"""Shafts and slides coupled by a mass matrix: the links of an arm in one pose, a cart with its pendulum, an axis on another axis."""

from collections.abc import Collection

from pydantic import Field

from ..inputs.part import Part
from ..inputs.quantities import Inertia


class MassMatrix(Part):
    """Inertias that several shafts or slides have together: their kinetic energy is ``w^T M w/2``.

    The matrix holds the inertias of these shafts in place of their own `inertia` or `mass`, which are then left out. Rotors and
    gears on a shaft are added to its diagonal. It is constant over a run; `Simulation.advance` may change it between steps.

    Examples
    --------
    >>> import lostmotion as lm
    >>> arm = lm.model.MassMatrix(shafts=["shoulder", "elbow"], matrix=[[2.6, 0.7], [0.7, 0.4]])
    >>> arm.of("elbow", "shoulder")
    0.7
    """

    shafts: tuple[str, ...] = Field(min_length=1)
    """names of the shafts and slides, in the order of the rows"""
    matrix: tuple[tuple[Inertia, ...], ...] = Field(min_length=1)
    """symmetric and positive definite; between two slides it has the unit kg, between a shaft and a slide kg*m"""

    def of(self, one: str, other: str) -> float:
        """Return the entry of two of its shafts.

        Parameters
        ----------
        one, other : str
            Names of shafts or slides of the matrix.

        Returns
        -------
        float
            Inertia [kg·m²]; of two slides a mass [kg], of a shaft and a slide [kg·m].

        Raises
        ------
        ValueError
            The matrix does not have one of them.

        Examples
        --------
        >>> import lostmotion as lm
        >>> lm.model.MassMatrix(shafts=["cart"], matrix=[[3.0]]).of("cart", "cart")
        3.0
        """
        return self.matrix[self.shafts.index(one)][self.shafts.index(other)]

    def among(self, shafts: Collection[str]) -> "MassMatrix":
        """Return the matrix of some of its shafts.

        Parameters
        ----------
        shafts : collection of str
            Names; shafts that the matrix does not have are ignored.

        Returns
        -------
        MassMatrix
            Their rows and columns, in the order of this matrix.

        Examples
        --------
        >>> import lostmotion as lm
        >>> lm.model.MassMatrix(shafts=["a", "b"], matrix=[[2.0, 0.5], [0.5, 1.0]]).among({"b"}).matrix
        ((1.0,),)
        """
        places = [k for k, name in enumerate(self.shafts) if name in shafts]
        return MassMatrix(
            shafts=tuple(self.shafts[k] for k in places),
            matrix=tuple(tuple(self.matrix[a][b] for b in places) for a in places),
        )

    def couples(self) -> list[tuple[str, str, float]]:
        """Return the pairs of shafts that the matrix couples.

        Returns
        -------
        list of tuple
            (one, other, entry) off the diagonal where the entry is not zero, each pair once.

        Examples
        --------
        >>> import lostmotion as lm
        >>> lm.model.MassMatrix(shafts=["a", "b"], matrix=[[2.0, 0.5], [0.5, 1.0]]).couples()
        [('b', 'a', 0.5)]
        """
        return [
            (one, other, self.matrix[a][b])
            for a, one in enumerate(self.shafts)
            for b, other in enumerate(self.shafts[:a])
            if self.matrix[a][b] != 0.0
        ]
