SELECT evaluation_id, kind, test_id
FROM evaluations
WHERE success <> (reached AND NOT collided AND NOT out_of_limits);
