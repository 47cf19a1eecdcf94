import { Table, type TableProps, Text } from "@mantine/core";
import { useId } from "react";
import { ScrolledTable } from "./ScrolledTable";
import classes from "./ui.module.css";

/**
 * A table that scrolls sideways if it is wider than the screen. Its first column stays in view, and its caption is above
 * the scrolling area.
 */
export function WideTable(props: TableProps & { minWidth: number; caption: string }) {
  const { minWidth, caption, children, ...table } = props;
  const id = useId();
  return (
    <div>
      <Text id={id} size="sm" c="dimmed" mb="xs">
        {caption}
      </Text>
      <ScrolledTable minWidth={minWidth}>
        <Table
          className={classes.wide ?? ""}
          withTableBorder
          verticalSpacing="xs"
          horizontalSpacing={6}
          aria-labelledby={id}
          {...table}
        >
          {children}
        </Table>
      </ScrolledTable>
    </div>
  );
}
