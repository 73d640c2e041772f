-- How long the present stage of a running job will take yet, as its worker estimates; NULL where it cannot say.
ALTER TABLE jobs ADD COLUMN remaining_ms INTEGER CHECK (remaining_ms IS NULL OR remaining_ms >= 0);
