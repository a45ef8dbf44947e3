-- The id of the one selection that has this id or begins so; an error where none does, or several.
CREATE OR REPLACE MACRO only_selection(name) AS (
    SELECT CASE
        WHEN count(DISTINCT selection_id) FILTER (selection_id = name) = 1 THEN name
        WHEN count(DISTINCT selection_id) = 1 THEN any_value(selection_id)
        ELSE error(count(DISTINCT selection_id) || ' selections begin with ' || name || ': name exactly one')
    END
    FROM selections
    WHERE starts_with(selection_id, name)
);
