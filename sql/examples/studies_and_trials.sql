-- Which studies have run, where, and how many trials has each?
SELECT studies.study, studies.run_at, studies.scene, studies.pool_label, count(*) AS trials
FROM studies
INNER JOIN evaluations USING (study, robot, scene, pool)
GROUP BY ALL
ORDER BY studies.run_at DESC, studies.study, studies.scene, studies.pool_label;
