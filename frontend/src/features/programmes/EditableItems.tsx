import { ActionIcon, Button, Group, Table, Text, VisuallyHidden } from "@mantine/core";
import { IconAdjustments, IconArrowDown, IconArrowUp, IconTrash } from "@tabler/icons-react";
import { useEffect, useRef, useState } from "react";
import type { Schemas } from "../../lib/api/client";
import { formatSpan } from "../../lib/format";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { itemWords } from "./describeProgramme";
import { type Draft, moved } from "./draft";

/** The programme's recordings in order, with buttons to move, set and remove them by finger or keyboard. */
export function EditableItems(props: {
  draft: Draft;
  checked: Schemas["ItemPreview"][];
  onChange: (draft: Draft) => void;
  onSet: (key: string) => void;
}) {
  const { draft, checked, onChange, onSet } = props;
  const buttons = useRef<Record<string, HTMLButtonElement | null>>({});
  const focus = useRef<string[]>([]);
  const [told, setTold] = useState("");
  // A moved item keeps the focus on the pressed button, or on the opposite one at the end of the list.
  useEffect(() => {
    const wanted = focus.current.map((name) => buttons.current[name]).find((one) => one && !one.disabled);
    focus.current = [];
    wanted?.focus();
  });
  if (draft.items.length === 0) return <Text>{t("programmes:items.none")}</Text>;
  const move = (place: number, by: 1 | -1) => {
    const item = draft.items[place];
    if (!item) return;
    const ways = by === 1 ? ["down", "up"] : ["up", "down"];
    focus.current = ways.map((way) => `${item.key} ${way}`);
    setTold(
      t("programmes:items.moved", {
        recording: item.recording_name,
        place: place + by + 1,
        of: draft.items.length,
      }),
    );
    onChange(moved(draft, place, by));
  };
  return (
    <>
      <VisuallyHidden role="status">{told}</VisuallyHidden>
      <Table verticalSpacing="sm" aria-label={t("programmes:items.caption")}>
        <Table.Thead>
          <Table.Tr>
            <Table.Th w={40}>{t("programmes:items.number")}</Table.Th>
            <Table.Th>{t("programmes:items.recording")}</Table.Th>
            <Table.Th>{t("programmes:items.played")}</Table.Th>
            <Table.Th ta="right">{t("programmes:items.time")}</Table.Th>
            <Table.Th>
              <VisuallyHidden>{t("programmes:items.change")}</VisuallyHidden>
            </Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {draft.items.map((item, place) => {
            const { recording_name: name } = item;
            const lasts = checked[place]?.duration_s;
            const arrow = (way: "up" | "down", by: 1 | -1, disabled: boolean) => (
              <ActionIcon
                size={44}
                variant="default"
                aria-label={t(`programmes:items.${way}`, { recording: name })}
                disabled={disabled}
                ref={(button) => {
                  buttons.current[`${item.key} ${way}`] = button;
                }}
                onClick={() => move(place, by)}
              >
                {way === "up" ? <IconArrowUp size={22} /> : <IconArrowDown size={22} />}
              </ActionIcon>
            );
            return (
              <Table.Tr key={item.key}>
                <Table.Td>{place + 1}</Table.Td>
                <Table.Td>{name}</Table.Td>
                <Table.Td>
                  {itemWords(item)}
                  {checked[place]?.problem && (
                    <Text fw={600} c="grape.9" role="alert">
                      {translateServerText(checked[place].problem, checked[place].problem_key)}
                    </Text>
                  )}
                </Table.Td>
                <Table.Td ta="right">{typeof lasts === "number" ? formatSpan(lasts) : "–"}</Table.Td>
                <Table.Td>
                  <Group gap="xs" wrap="nowrap" justify="end">
                    <Button
                      size="md"
                      variant="default"
                      aria-label={t("programmes:items.settingsOf", { recording: name })}
                      leftSection={<IconAdjustments size={20} />}
                      onClick={() => onSet(item.key)}
                    >
                      {t("programmes:items.settings")}
                    </Button>
                    {arrow("up", -1, place === 0)}
                    {arrow("down", 1, place === draft.items.length - 1)}
                    <ActionIcon
                      size={44}
                      variant="default"
                      aria-label={t("programmes:items.remove", { recording: name })}
                      onClick={() =>
                        onChange({ ...draft, items: draft.items.filter((one) => one.key !== item.key) })
                      }
                    >
                      <IconTrash size={22} />
                    </ActionIcon>
                  </Group>
                </Table.Td>
              </Table.Tr>
            );
          })}
        </Table.Tbody>
      </Table>
    </>
  );
}
