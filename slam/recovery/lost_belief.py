"""The probability that the robot is lost, from how well its scans agree with the map."""

from __future__ import annotations

import math
from collections import deque

from slam.recovery.agreement import Agreement
from slam.recovery.signs import Sign, Signs

LOSS_RATE = 1e-5  # probability of getting lost from one keyframe to the next
JUMP_RATE = 0.3  # the same after a sign of it
RETURN_RATE = 1e-3  # probability that a lost robot is right by chance at the next keyframe
EXPLAINED_WEIGHT, CONTRADICTED_WEIGHT = -3.2, 5.9  # nats, fitted by logistic regression
CONTRADICTED_SPREAD = 0.05  # added to the usual share of contradicted echoes
CORRELATION = 0.5  # weight of a keyframe: neighbouring ones see the same walls
MAX_EVIDENCE = 3.0  # nats of one keyframe
USUAL = 0.9, 0.03  # shares of explained and contradicted echoes before any are known
MIN_LEARNED = 10  # keyframes before a change can be told from the usual ones
MEMORY = 50  # keyframes over which the usual shares are averaged
RECENT = 8  # keyframes, of which the best fit is expected
LEAST_EXPLAINED = 0.1  # of the usual share
LEAST_SPREAD = 0.03  # of the share of explained echoes
NO_MORE_CONTRADICTED = 0.03  # than usual, where the map does not contradict a scan
LESS_EXPLAINED = 2.0  # usual deviations below the usual share of explained echoes,
MORE_CONTRADICTED = 0.15  # and share of contradicted ones above the usual: the map hardly agrees
HARDLY_EXPLAINED = 0.25, 5.0  # of the usual share, and usual deviations below it


class LostBelief:
    """A hidden Markov model of two states, lost or not, updated at keyframes.

    Its observations are the shares of echoes that lie on occupied cells and in free ones, in
    relation to the shares usual in this recording: wrong beams, people and distant scans lower the
    agreement of every scan.

    probability  that the robot is lost
    sign         that the robot was carried since the keyframe before, if there is one
    explained    usual share of echoes that the map explains; contradicted: that it contradicts
    spread       usual deviation of the share of explained echoes from its mean;
                 contradicted_spread: of contradicted ones
    """

    def __init__(self) -> None:
        self.probability = LOSS_RATE
        self.explained, self.contradicted = USUAL
        self.spread, self.contradicted_spread = LEAST_SPREAD, 0.0
        self.sign: Sign | None = None
        self._signs = Signs()
        self._score = 0.0  # usual mean log-likelihood per beam
        self._recent: deque[float] = deque([-math.inf], RECENT)  # of the last keyframes
        self._learned = 0.0  # number of keyframes that the usual shares are the mean of

    def evidence(self, agreement: Agreement) -> float:
        """Log-likelihood ratio, nats, of lost to not lost."""
        return (
            EXPLAINED_WEIGHT * agreement.explained / self.explained
            + CONTRADICTED_WEIGHT
            * agreement.contradicted
            / math.sqrt(self.contradicted + CONTRADICTED_SPREAD)
        )

    def update(
        self,
        agreement: Agreement,
        change: float,
        sudden: bool = False,
        continuous: bool = True,
        arriving: bool = False,
    ) -> None:
        """Update the probability by a keyframe.

        change      of the scan since the keyframe before (see `continuity.change`)
        sudden      whether it does not follow from the keyframes before for another reason
        continuous  whether it sees much the same as the one before
        arriving    whether the robot may come from new ground, of which the map explains less
        """
        known = self._learned >= MIN_LEARNED
        seen = self._signs.seen(agreement, change, continuous, arriving)
        self.sign = (Sign.SCAN if sudden else seen) if known else None
        loss = LOSS_RATE if self.sign is None else JUMP_RATE
        before = self.probability * (1.0 - RETURN_RATE) + (1.0 - self.probability) * loss
        evidence = CORRELATION * self.evidence(agreement)
        ratio = math.exp(min(max(evidence, -MAX_EVIDENCE), MAX_EVIDENCE))
        self.probability = before * ratio / (before * ratio + 1.0 - before) if known else LOSS_RATE

    def learn(self, agreement: Agreement, score: float, change: float) -> None:
        """Learn what is usual from a keyframe at a pose that is not doubted."""
        self._learned = min(self._learned + 1.0, MEMORY)
        rate = 1.0 / (self._learned + 1.0)
        explained = max(agreement.explained, LEAST_EXPLAINED)
        self.spread += rate * (abs(explained - self.explained) - self.spread)
        self.explained += rate * (explained - self.explained)
        off = abs(agreement.contradicted - self.contradicted)
        self.contradicted_spread += rate * (off - self.contradicted_spread)
        self.contradicted += rate * (agreement.contradicted - self.contradicted)
        self._score += rate * (score - self._score)
        self._recent.append(score)
        self._signs.learn(change, rate)

    @property
    def score(self) -> float:
        """Mean log-likelihood per beam that is expected of a keyframe."""
        return max(self._score, *self._recent)

    def usual(self, agreement: Agreement) -> bool:
        """Whether the map explains about as much as usual."""
        return agreement.explained > self.explained - max(LEAST_SPREAD, self.spread)

    def contradicts_more(self, agreement: Agreement) -> bool:
        """Whether the map contradicts more than usual."""
        more = max(NO_MORE_CONTRADICTED, self.contradicted_spread)
        return agreement.contradicted > self.contradicted + more

    def hardly_agrees(self, agreement: Agreement) -> bool:
        """Whether the map explains so much less than usual, and contradicts so much more, that a
        match may follow something that moves."""
        less = agreement.explained < self.explained - LESS_EXPLAINED * self.spread
        return less and agreement.contradicted > self.contradicted + MORE_CONTRADICTED

    def hardly_explains(self, agreement: Agreement) -> bool:
        """Whether the map explains nearly nothing of what it usually does."""
        share, deviations = HARDLY_EXPLAINED
        least = self.explained - deviations * self.spread
        return agreement.explained < min(share * self.explained, least)

    def dismiss(self, sign: Sign) -> None:
        """The last doubt that began with this sign meant nothing."""
        self._signs.dismiss(sign)

    def set(self, probability: float) -> None:
        """Set the probability, after a search of the whole map."""
        self.probability = probability
