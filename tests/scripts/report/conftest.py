"""Few resamples: what a report shows is looked at here, not how sure its intervals are."""

import pytest

from slam.benchmark import statistics


@pytest.fixture(scope="module", autouse=True)
def few_resamples():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(statistics, "RESAMPLES", 99)
        yield
