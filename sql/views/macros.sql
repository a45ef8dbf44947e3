-- Definitions of the metrics that follow from the waypoints alone. Tool positions need the robot's
-- kinematics, so path_length and smoothness are columns only.

-- q: waypoints x joints. Sum over steps and joints of the absolute joint differences, rad (m).
CREATE OR REPLACE MACRO joint_movement(q) AS coalesce(list_sum(list_transform(
    range(2, len(q) + 1),
    lambda i: list_sum(list_transform(
        range(1, len(q[i]) + 1),
        lambda j: abs(q[i][j]::DOUBLE - q[i - 1][j]::DOUBLE)
    ))
)), 0);

-- Seconds from the first waypoint to the last one.
CREATE OR REPLACE MACRO duration(q, dt) AS greatest(len(q) - 1, 0) * dt;

-- Metres between two points.
CREATE OR REPLACE MACRO distance_between(x1, y1, z1, x2, y2, z2) AS
    sqrt((x1 - x2) ^ 2 + (y1 - y2) ^ 2 + (z1 - z2) ^ 2);
