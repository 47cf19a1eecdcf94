import { Table, type TableProps } from "@mantine/core";
import { ScrolledTable } from "./ScrolledTable";
import classes from "./ui.module.css";

/** A table that scrolls sideways if it is wider than the screen. Its caption stays in view. */
export function WideTable(props: TableProps & { minWidth: number; caption: string }) {
  const { minWidth, caption, children, ...table } = props;
  return (
    <ScrolledTable minWidth={minWidth} className={classes.wide ?? ""}>
      <Table withTableBorder captionSide="top" verticalSpacing="xs" horizontalSpacing={6} {...table}>
        <Table.Caption ta="start" mb="xs">
          <span className={classes.caption}>{caption}</span>
        </Table.Caption>
        {children}
      </Table>
    </ScrolledTable>
  );
}
