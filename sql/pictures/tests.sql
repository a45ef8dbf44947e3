-- Tests of a network with what another one made of the same: those where this one succeeds and the other does
-- not come first, collisions of the other before what was merely lost. Grain: one test.
-- $study, $scene; $selector, $policy, $seed, $against: of the two networks, alike but for the selector.
SELECT
    own.x,
    own.y,
    own.z,
    own.success,
    coalesce(other.success, own.success) AS other_success
FROM evaluations AS own
LEFT JOIN evaluations AS other
    ON
        own.study = other.study
        AND own.scene = other.scene
        AND own.pool = other.pool
        AND own.kind = other.kind
        AND own.test_id = other.test_id
        AND own.policy = other.policy
        AND own.seed = other.seed
        AND own.round = other.round
        AND other.selector = $against
WHERE
    own.study = $study
    AND own.scene = $scene
    AND own.selector = $selector
    AND own.policy = $policy
    AND own.seed = $seed
ORDER BY
    own.success DESC, coalesce(other.success, false), own.kind <> 'displaced' DESC,
    coalesce(other.collided, false) DESC, own.hard DESC, own.test_id
LIMIT 1;
