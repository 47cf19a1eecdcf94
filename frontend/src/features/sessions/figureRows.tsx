import { Table } from "@mantine/core";

/** The column names. All columns except the first contain figures. */
export function Head({ first, others }: { first: string; others: string[] }) {
  return (
    <Table.Thead>
      <Table.Tr>
        <Table.Th>{first}</Table.Th>
        {others.map((name) => (
          <Table.Th key={name} ta="right">
            {name}
          </Table.Th>
        ))}
      </Table.Tr>
    </Table.Thead>
  );
}

/** A label and its figures. */
export function Row({ first, others }: { first: string; others: string[] }) {
  return (
    <Table.Tr>
      <Table.Td>{first}</Table.Td>
      {others.map((text, place) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: a cell is its column.
        <Table.Td key={place} ta="right" style={{ whiteSpace: "nowrap" }}>
          {text}
        </Table.Td>
      ))}
    </Table.Tr>
  );
}
