-- Statistics of k successes in n trials, and of paired trials.

-- Lower end of Wilson's 95 % interval of the rate k / n; null without trials.
CREATE OR REPLACE MACRO wilson_low(k, n) AS CASE WHEN k = 0 AND n > 0 THEN 0 ELSE
    (
        k + 1.9207294103470914
        - 1.959963984540054 * sqrt(k::DOUBLE * (n - k) / nullif(n, 0) + 0.9603647051735457)
    ) / (n + 3.8414588206941828)
END;

-- Upper end of Wilson's 95 % interval of the rate k / n; null without trials.
CREATE OR REPLACE MACRO wilson_high(k, n) AS CASE WHEN k = n AND n > 0 THEN 1 ELSE
    (
        k + 1.9207294103470914
        + 1.959963984540054 * sqrt(k::DOUBLE * (n - k) / nullif(n, 0) + 0.9603647051735457)
    ) / (n + 3.8414588206941828)
END;

-- McNemar's exact two-sided p: of trials made by both, how many only the one passed, and only the other.
CREATE OR REPLACE MACRO paired_p(only_one, only_other) AS least(1, 2 * list_sum(list_transform(
    range(0, least(only_one, only_other)::BIGINT + 1),
    lambda i: exp(
        lgamma(only_one + only_other + 1) - lgamma(i + 1) - lgamma(only_one + only_other - i + 1)
        - (only_one + only_other) * ln(2)
    )
)));
