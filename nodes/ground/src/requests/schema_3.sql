-- Schema 3: strips belong to orders; what was stored before is an order of its own, with its other direction.
ALTER TABLE requests ADD COLUMN order_id INTEGER NOT NULL DEFAULT 0;
ALTER TABLE requests ADD COLUMN order_ref TEXT NOT NULL DEFAULT '';
ALTER TABLE requests ADD COLUMN part INTEGER NOT NULL DEFAULT 0;
ALTER TABLE requests ADD COLUMN parts INTEGER NOT NULL DEFAULT 0;
ALTER TABLE requests ADD COLUMN share REAL NOT NULL DEFAULT 0;
UPDATE requests SET order_id = min(id, coalesce(linked, id));
