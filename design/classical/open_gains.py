"""The gains that are left to choose, when others are given: loops affine in as many unknowns.

The products y of all gains (`design.classical.normal_form`) are affine in the unknowns z, whichever gains are given:
``y = y_0 + B z``. So are, with them, the loop transfer's numerator, the closed-loop polynomial and what else is judged.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from design.classical.normal_form import NormalForm
from model.arrays import FloatArray, Floats, GridArrays

#: The least that an unknown which may not be zero is: the integrator's, and that of the inner tab loop.
SMALLEST = 1e-4


@dataclass(frozen=True, eq=False)
class OpenGains(GridArrays):
    """The family of loops of P points over their J unknowns z, all at least 0. Polynomials as in `NormalForm`.

    In every array of rows the first is the part without unknowns, the others belong to the unknowns: ``row_0 + sum_k
    z_k row_k``.

    Attributes
    ----------
    form : normal form, G = (P,)
    products : (P, 1 + J, Y) rows of the products y of the gains
    loop : (P, 1 + J, n + 1) rows of the numerator of the loop transfer, without its delay
    noise : (P, 1 + J, n + 1) rows of ``sum_j y_j noise_j``
    characteristic : (P, 1 + J, m + 1) rows of the closed-loop polynomial p(x), with the delay's Pade approximant
    aileron, tab : (P, m + 1) of ``r_a -> da`` and ``r_a -> dt`` over y_i, with the delay's Pade approximant
    least : (P, J) the least that each unknown can be
    given : (P, Y) non-dimensional gains that are given, nan where one is chosen
    """

    form: NormalForm
    products: FloatArray
    loop: FloatArray
    noise: FloatArray
    characteristic: FloatArray
    aileron: FloatArray
    tab: FloatArray
    least: FloatArray
    given: FloatArray

    @classmethod
    def of(cls, form: NormalForm, names: tuple[str, ...], gains: Mapping[str, Floats]) -> OpenGains:
        """Family of each point, G = (P,), when some `gains` are given in SI, each a number or (P,), by name."""
        points = form.frequency.size
        given = np.full((points, len(names)), np.nan)
        for name, value in gains.items():
            given[:, names.index(name)] = value
        kappa = given / form.gain_units
        chosen = [j for j, name in enumerate(names) if name not in gains]
        products = np.zeros((points, 1 + len(chosen), len(names)))
        # The unknowns of a rate command whose inner gain is chosen: that gain, and products with it.
        scaled = form.rate_command and names[0] not in gains
        inner = kappa[:, 0] if form.rate_command and not scaled else np.ones(points)
        for j, name in enumerate(names):
            row = 1 if scaled else 0
            if name not in gains:
                products[:, 1 + chosen.index(j), j] = 1.0
            elif form.rate_command and j == 0:
                products[:, 0, 0] = kappa[:, 0]
            else:
                products[:, row, j] = kappa[:, j] * (1.0 if scaled else inner)
        loop = _combined(products, form.numerators)
        closed = form.late(loop)
        closed = np.concatenate([closed[:, :1] + form.prompt(form.denominator)[:, None], closed[:, 1:]], axis=1)
        positive = [names[j] in ("K_theta", "K_i") for j in chosen]
        return cls(
            form=form,
            products=products,
            loop=loop,
            noise=_combined(products, form.noise),
            characteristic=closed,
            aileron=form.late(form.numerators[:, -1]),
            tab=form.late(form.tab),
            least=np.where(positive, SMALLEST, 0.0) * np.ones((points, 1)),
            given=kappa,
        )

    @property
    def unknowns(self) -> int:
        """How many gains are chosen, J."""
        return int(self.products.shape[-2]) - 1

    def kappas(self, z: FloatArray) -> FloatArray:
        """Non-dimensional gains (P, Y) of the unknowns (P, J); those that are given to the last bit."""
        y = self.products[:, 0] + np.einsum("pj,pjy->py", z, self.products[:, 1:])
        return np.where(np.isnan(self.given), self.form.kappas(y), self.given)

    def basis(self, z: FloatArray) -> FloatArray:
        """Directions (P, J, J), as columns, to change the unknowns (P, J) along, each as long as changes the loop.

        In terms of the gains: all of the integrator's and of the inner tab loop's, each with the other gains held,
        and for the others the damping and the stiffness that they have besides those of the aileron.
        """
        kappa = self.kappas(z)
        size = np.maximum(kappa, 0.25)
        if self.form.positive:
            size[:, -2] = np.maximum(0.5 * np.abs(1.0 - kappa[:, -2]), 0.03)
        size[:, -1] = kappa[:, -1]
        if self.form.rate_command:
            size[:, 1:] *= kappa[:, :1]
            size[:, 0] = kappa[:, 0]
        chosen = np.isnan(self.given[0])
        basis = size[:, chosen, None] * np.eye(z.shape[1])
        if self.form.rate_command and chosen[0]:
            basis[:, :, 0] = z
        return np.asarray(basis)

    def unknowns_of(self, kappa: FloatArray) -> FloatArray:
        """Unknowns (P, J) of non-dimensional gains (P, Y), those that are given put in their place."""
        kappa = np.where(np.isnan(self.given), kappa, self.given)
        y = np.concatenate([kappa[:, :1], kappa[:, :1] * kappa[:, 1:]], axis=-1) if self.form.rate_command else kappa
        return np.asarray(y[:, np.isnan(self.given[0])])


def _combined(products: FloatArray, polynomials: FloatArray) -> FloatArray:
    """Rows (P, 1 + J, n + 1) of what is linear in the products, (P, Y, n + 1) by product."""
    return np.asarray(products @ polynomials)
