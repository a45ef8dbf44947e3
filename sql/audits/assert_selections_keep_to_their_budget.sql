SELECT study, selection_id, any_value(budget) AS budget, any_value(n_targets) AS targets, count(*) AS kept
FROM selections
GROUP BY study, selection_id
HAVING kept > coalesce(budget * targets, any_value(n_pool));
