import { Table, type TableScrollContainerProps } from "@mantine/core";
import { reachByKeyboard } from "./reachByKeyboard";

/**
 * The frame of a table that scrolls sideways where it is wider than the screen, also by keyboard. The bar is then always
 * visible, because a table without it looks complete.
 */
export const ScrolledTable = (props: TableScrollContainerProps) => (
  <Table.ScrollContainer scrollAreaProps={{ viewportRef: reachByKeyboard, type: "auto" }} {...props} />
);
