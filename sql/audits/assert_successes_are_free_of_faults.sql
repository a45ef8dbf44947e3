SELECT evaluation_id, kind, test_id
FROM evaluations
WHERE
    success <> (reached AND NOT collided AND NOT out_of_limits)
    OR success <> (failure = '')
    OR collided <> (failure = 'collided')
    OR out_of_limits <> (failure = 'limits');
