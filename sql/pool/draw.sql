-- One number in [0, 1) a candidate that looks random and depends on $salt and its id alone, so that a draw
-- is the same in any order, with any other candidates beside it, and a smaller budget draws a subset.
SELECT
    "row",
    md5_number_lower($salt || '/' || trajectory_id) / 18446744073709551616.0::DOUBLE AS draw
FROM candidates
ORDER BY "row";
