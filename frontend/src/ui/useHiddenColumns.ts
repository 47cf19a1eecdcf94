import { useLocalStorage } from "@mantine/hooks";
import type { Column } from "./tableRows";
import { useOnTelephone } from "./useOnTelephone";

/**
 * Return the keys of a table's hidden columns, and a function that stores the user's choice. A telephone has its own
 * choice. Until the user chooses there, it hides the columns that are marked for wide screens, and those that it shows
 * below others, which `movedBelow` returns for a column.
 */
export function useHiddenColumns<Row>(name: string, columns: Column<Row>[]) {
  const onTelephone = useOnTelephone();
  const [onWide, setOnWide] = useLocalStorage<string[]>({ key: `kata.columns.${name}`, defaultValue: [] });
  // Without a default value nothing is stored before the user chooses.
  const [onNarrow, setOnNarrow] = useLocalStorage<string[] | undefined>({
    key: `kata.columns.${name}.telephone`,
  });
  if (!onTelephone) return { hidden: onWide, setHidden: setOnWide, movedBelow: () => [] };
  const wide = columns.filter(({ onWide, below }) => onWide || below).map(({ key }) => key);
  const hidden = onNarrow ?? wide;
  const movedBelow = ({ key }: Column<Row>) =>
    columns.filter((column) => column.below === key && hidden.includes(column.key));
  return { hidden, setHidden: setOnNarrow, movedBelow };
}
