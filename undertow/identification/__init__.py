"""The identification model whose error drives the estimator."""

from undertow.identification.series_parallel import SeriesParallel as SeriesParallel
