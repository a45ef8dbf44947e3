-- Where the tests of a study lie: what tells whether two studies tested the same.
-- Grain: scene, pool label, test.
-- $study: evaluations.study; $kind: test targets: 'displaced', 'unseen' or 'unseen_scene'.
SELECT DISTINCT
    scene,
    pool_label,
    test_id,
    x,
    y,
    z
FROM final_trials($study, $kind)
ORDER BY scene, pool_label, test_id;
