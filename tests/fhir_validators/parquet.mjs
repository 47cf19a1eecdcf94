// Reads a Parquet file: `node parquet.mjs FILE` prints its metadata and columns as JSON.
import { asyncBufferFromFile, parquetMetadataAsync, parquetReadObjects } from "hyparquet";

const file = await asyncBufferFromFile(process.argv[2]);
const { key_value_metadata, schema } = await parquetMetadataAsync(file);
const rows = await parquetReadObjects({ file });
const names = schema.slice(1).map((column) => column.name);
const columns = Object.fromEntries(names.map((name) => [name, rows.map((row) => row[name] ?? null)]));
const metadata = Object.fromEntries(key_value_metadata.map(({ key, value }) => [key, value]));
const number = (_, value) => (typeof value === "bigint" ? Number(value) : value);
console.log(JSON.stringify({ metadata, columns }, number));
