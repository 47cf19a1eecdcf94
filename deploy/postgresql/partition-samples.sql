-- Partitions the table run_sample_blocks by month (UTC). Kata does not need it: docs/explanation/decisions/0040 says when it is worth it.
--
-- Stop every Kata that uses the database, make a backup, then run this file as Kata's user:
--     psql --single-transaction --set ON_ERROR_STOP=1 --file partition-samples.sql DATABASE
-- Run it again at least once in two years, with the services running: it adds the missing months. Rows of a month without a partition
-- are in run_sample_blocks_default until then.
--
-- The rows of the past stay where they are, in the partition run_sample_blocks_past. Only their index is built again.

DO $$
DECLARE
    months CONSTANT integer := 24;
    this_month CONSTANT date := date_trunc('month', now() AT TIME ZONE 'UTC');
    next_month CONSTANT date := this_month + interval '1 month';
    month_start date;
    part text;
BEGIN
    IF (SELECT relkind FROM pg_class WHERE oid = 'run_sample_blocks'::regclass) = 'r' THEN
        ALTER TABLE run_sample_blocks RENAME TO run_sample_blocks_past;
        -- A constant default does not rewrite the table.
        EXECUTE format('ALTER TABLE run_sample_blocks_past ADD COLUMN month date NOT NULL DEFAULT %L', this_month);
        ALTER TABLE run_sample_blocks_past DROP CONSTRAINT pk_run_sample_blocks;
        ALTER TABLE run_sample_blocks_past ADD PRIMARY KEY (run_id, number, month);
        EXECUTE format('ALTER TABLE run_sample_blocks_past ADD CHECK (month < %L)', next_month);

        CREATE TABLE run_sample_blocks (LIKE run_sample_blocks_past) PARTITION BY RANGE (month);
        -- The service does not name the column. A row that arrives late gets the month of its arrival.
        ALTER TABLE run_sample_blocks ALTER COLUMN month SET DEFAULT date_trunc('month', now() AT TIME ZONE 'UTC');
        -- The key of a partitioned table must contain the month. That a run is stored once is ensured by the key of run_samples.
        ALTER TABLE run_sample_blocks ADD CONSTRAINT pk_run_sample_blocks PRIMARY KEY (run_id, number, month);
        ALTER TABLE run_sample_blocks ADD CONSTRAINT fk_run_sample_blocks_run_id_run_samples
            FOREIGN KEY (run_id) REFERENCES run_samples (run_id) ON DELETE CASCADE;
        EXECUTE format(
            'ALTER TABLE run_sample_blocks ATTACH PARTITION run_sample_blocks_past FOR VALUES FROM (MINVALUE) TO (%L)', next_month
        );
        CREATE TABLE run_sample_blocks_default PARTITION OF run_sample_blocks DEFAULT;
    END IF;

    FOR number IN 1..months LOOP
        month_start := this_month + make_interval(months => number);
        part := 'run_sample_blocks_' || to_char(month_start, 'YYYY_MM');
        CONTINUE WHEN to_regclass(part) IS NOT NULL;
        EXECUTE format('CREATE TABLE %I (LIKE run_sample_blocks INCLUDING DEFAULTS)', part);
        EXECUTE format(
            'WITH moved AS (DELETE FROM run_sample_blocks_default WHERE month = %L RETURNING *) INSERT INTO %I SELECT * FROM moved',
            month_start, part
        );
        EXECUTE format(
            'ALTER TABLE run_sample_blocks ATTACH PARTITION %I FOR VALUES FROM (%L) TO (%L)',
            part, month_start, month_start + interval '1 month'
        );
    END LOOP;
END
$$;
