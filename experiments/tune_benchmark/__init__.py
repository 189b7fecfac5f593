"""Race tuning by the gradient against quasi-Newton, random search, CMA-ES and a sweep: equal compute in forward episodes, judged by exact
metrics in worlds that none of them has seen."""
