import { Checkbox, Table } from "@mantine/core";
import { useState } from "react";
import { t } from "../lib/i18n";
import classes from "./ui.module.css";

/** The selected rows of a table. Rows that the table does not show any more are not selected. */
export interface Selection {
  count: number;
  all: boolean;
  has: (id: string) => boolean;
  select: (id: string, selected: boolean) => void;
  selectAll: (selected: boolean) => void;
}

/** Store which of the shown rows are selected. `shown`: their ids. */
export function useSelection(shown: string[]): Selection {
  const [chosen, setChosen] = useState<string[]>([]);
  const selected = new Set(shown.filter((id) => chosen.includes(id)));
  return {
    count: selected.size,
    all: selected.size > 0 && selected.size === shown.length,
    has: (id) => selected.has(id),
    select: (id, on) => setChosen(on ? [...selected, id] : [...selected].filter((other) => other !== id)),
    selectAll: (on) => setChosen(on ? shown : []),
  };
}

/** The cell in the head that selects all rows or none. */
export function SelectAll({ selection }: { selection: Selection }) {
  return (
    <Table.Th className={classes.select ?? ""}>
      <SelectBox
        label={t("ui:table.selectAll")}
        checked={selection.all}
        indeterminate={selection.count > 0 && !selection.all}
        onChange={selection.selectAll}
      />
    </Table.Th>
  );
}

/** The cell that selects its row. */
export function SelectRow({ id, name, selection }: { id: string; name: string; selection: Selection }) {
  return (
    <Table.Td className={classes.select ?? ""}>
      <SelectBox
        label={t("ui:table.select", { name })}
        checked={selection.has(id)}
        onChange={(on) => selection.select(id, on)}
      />
    </Table.Td>
  );
}

function SelectBox(props: {
  label: string;
  checked: boolean;
  indeterminate?: boolean;
  onChange: (on: boolean) => void;
}) {
  return (
    <Checkbox
      size="md"
      aria-label={props.label}
      checked={props.checked}
      indeterminate={props.indeterminate ?? false}
      onChange={(event) => props.onChange(event.currentTarget.checked)}
    />
  );
}
