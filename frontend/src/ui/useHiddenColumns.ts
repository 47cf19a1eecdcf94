import { useLocalStorage } from "@mantine/hooks";
import type { Column } from "./tableRows";
import { useOnTelephone } from "./useOnTelephone";

/**
 * Return the keys of a table's hidden columns, and a function that stores the user's choice. A telephone has its own
 * choice. Until the user chooses there, it hides the columns that are marked for wide screens.
 */
export function useHiddenColumns<Row>(name: string, columns: Column<Row>[]) {
  const onTelephone = useOnTelephone();
  const [onWide, setOnWide] = useLocalStorage<string[]>({ key: `kata.columns.${name}`, defaultValue: [] });
  // Without a default value nothing is stored before the user chooses.
  const [onNarrow, setOnNarrow] = useLocalStorage<string[] | undefined>({
    key: `kata.columns.${name}.telephone`,
  });
  if (!onTelephone) return { hidden: onWide, setHidden: setOnWide };
  const wide = columns.filter((column) => column.onWide).map(({ key }) => key);
  return { hidden: onNarrow ?? wide, setHidden: setOnNarrow };
}
