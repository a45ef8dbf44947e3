-- Where the tables of catalog.duckdb lie: in its own folder, wherever that is now. A view can't ask for its
-- database's path where a table function needs one, but DuckDB derives its default temp_directory from it.
-- A session that opened another database and attached the catalog names the folder itself.
CREATE OR REPLACE MACRO lake_folder() AS CASE
    WHEN getvariable('lake_folder') IS NOT NULL
        THEN rtrim(getvariable('lake_folder'), '/\') || '/'
    WHEN regexp_matches(current_setting('temp_directory'), '(^|[/\\])catalog\.duckdb\.tmp$')
        THEN regexp_replace(current_setting('temp_directory'), 'catalog\.duckdb\.tmp$', '')
    ELSE error(
        'the lake''s catalog can''t tell where it lies: open catalog.duckdb itself, without a temp_directory'
        || ' of your own, or say SET VARIABLE lake_folder = ''its folder'''
    )
END;

-- Pattern of files below that folder, whose own name may hold *, ? and [.
CREATE OR REPLACE MACRO lake_files(pattern) AS
    regexp_replace(lake_folder(), '([*?\[])', '[\1]', 'g') || pattern;

-- True, or an error where a catalog is attached whose views would read another one's folder.
CREATE OR REPLACE MACRO is_beside_catalog() AS (
    SELECT coalesce(bool_and(
        CASE WHEN path = lake_folder() || 'catalog.duckdb' THEN true ELSE error(
            'the catalog ' || path || ' would answer from ' || lake_folder() || ': open it alone, or say'
            || ' SET VARIABLE lake_folder = ''' || regexp_replace(path, '[/\\]?catalog\.duckdb$', '') || ''''
        ) END
    ), true)
    FROM duckdb_databases()
    WHERE regexp_matches(path, '(^|[/\\])catalog\.duckdb$')
);
