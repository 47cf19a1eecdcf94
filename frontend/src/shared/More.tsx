import { Group, Pagination, Text } from "@mantine/core";

const PAGE = 50;

/** Further pages of a list, where there are any. */
export function More(props: { total: number; offset: number; onOffset: (offset: number) => void }) {
  if (props.total <= PAGE) return null;
  return (
    <Group justify="space-between">
      <Text size="sm">{props.total} in all</Text>
      <Pagination
        size="lg"
        total={Math.ceil(props.total / PAGE)}
        value={props.offset / PAGE + 1}
        onChange={(page) => props.onOffset((page - 1) * PAGE)}
      />
    </Group>
  );
}
