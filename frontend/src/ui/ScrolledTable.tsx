import { Table, type TableScrollContainerProps } from "@mantine/core";
import { reachByKeyboard } from "./reachByKeyboard";

/** The frame of a table that scrolls sideways where it is wider than the screen, also by keyboard. */
export const ScrolledTable = (props: TableScrollContainerProps) => (
  <Table.ScrollContainer scrollAreaProps={{ viewportRef: reachByKeyboard }} {...props} />
);
