-- Networks of a study and the champion of their policy on the unseen targets that both were tested on,
-- whatever their numbers: McNemar's exact test. Grain: evaluation, the most successful first.
-- $challenger: evaluations.study; $robot, $scene, $pool, $policy: whose networks; $champion: its
-- evaluation_id, of this or another study.
WITH champion AS (
    SELECT DISTINCT
        x,
        y,
        z,
        success
    FROM evaluations
    WHERE evaluation_id = $champion AND kind = 'unseen'
)

SELECT
    evaluation_id,
    count(*)::INTEGER AS n,
    count_if(challenger.success)::INTEGER AS successes,
    count_if(champion.success)::INTEGER AS champion_successes,
    paired_p(
        count_if(challenger.success AND NOT champion.success),
        count_if(champion.success AND NOT challenger.success)
    ) AS p
FROM final_trials($challenger, 'unseen') AS challenger
INNER JOIN champion USING (x, y, z)
WHERE
    challenger.robot = $robot
    AND challenger.scene = $scene
    AND challenger.pool = $pool
    AND challenger.policy = $policy
GROUP BY evaluation_id
ORDER BY successes DESC, evaluation_id;
