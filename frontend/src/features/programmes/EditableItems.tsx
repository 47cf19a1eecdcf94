import "./catalogue";
import { ActionIcon, Button, Group, Table, Text, VisuallyHidden } from "@mantine/core";
import { IconAdjustments, IconArrowDown, IconArrowUp, IconTrash } from "@tabler/icons-react";
import { useEffect, useRef, useState } from "react";
import type { Schemas } from "../../lib/api/client";
import { formatDuration } from "../../lib/format";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { describePrescription } from "./describeProgramme";
import { type Draft, type DraftItem, moved } from "./draft";

/** The programme's recordings in order, with buttons to move, set and remove them by finger or keyboard. */
export function EditableItems(props: {
  draft: Draft;
  checked: Schemas["ItemPreview"][];
  onChange: (draft: Draft) => void;
  onSet: (key: string) => void;
}) {
  const { draft, checked, onChange, onSet } = props;
  const { buttons, focus } = useMovedFocus();
  const [announcement, setAnnouncement] = useState("");
  if (draft.items.length === 0) return <Text>{t("programmes:items.none")}</Text>;
  const move = (place: number, by: 1 | -1) => {
    const item = draft.items[place];
    if (!item) return;
    const ways = by === 1 ? ["down", "up"] : ["up", "down"];
    focus.current = ways.map((way) => `${item.key} ${way}`);
    setAnnouncement(
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
      <VisuallyHidden role="status">{announcement}</VisuallyHidden>
      <Table verticalSpacing="sm" aria-label={t("programmes:items.caption")}>
        <ItemsHead />
        <Table.Tbody>
          {draft.items.map((item, place) => (
            <ItemRow
              key={item.key}
              item={item}
              place={place}
              checked={checked[place]}
              isLast={place === draft.items.length - 1}
              onButton={(way, button) => {
                buttons.current[`${item.key} ${way}`] = button;
              }}
              onMove={(by) => move(place, by)}
              onSet={() => onSet(item.key)}
              onRemove={() =>
                onChange({ ...draft, items: draft.items.filter(({ key }) => key !== item.key) })
              }
            />
          ))}
        </Table.Tbody>
      </Table>
    </>
  );
}

/**
 * Keep the focus on the pressed button of a moved item, or on the opposite button at the end of the list.
 * `buttons` contains the buttons by name; `focus` names the buttons to try after the next rendering.
 */
function useMovedFocus() {
  const buttons = useRef<Record<string, HTMLButtonElement | null>>({});
  const focus = useRef<string[]>([]);
  useEffect(() => {
    const wanted = focus.current
      .map((name) => buttons.current[name])
      .find((button) => button && !button.disabled);
    focus.current = [];
    wanted?.focus();
  });
  return { buttons, focus };
}

function ItemsHead() {
  return (
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
  );
}

type Way = "up" | "down";
type Moving = {
  name: string;
  /** Receives the button, so that the button of a moved item can get the focus. */
  onButton: (way: Way, button: HTMLButtonElement | null) => void;
  onMove: (by: 1 | -1) => void;
};

function MoveButton({ way, disabled, name, onButton, onMove }: Moving & { way: Way; disabled: boolean }) {
  return (
    <ActionIcon
      size={44}
      variant="default"
      aria-label={t(`programmes:items.${way}`, { recording: name })}
      disabled={disabled}
      ref={(button) => {
        onButton(way, button);
      }}
      onClick={() => onMove(way === "up" ? -1 : 1)}
    >
      {way === "up" ? <IconArrowUp size={22} /> : <IconArrowDown size={22} />}
    </ActionIcon>
  );
}

function ItemRow(
  props: Omit<Moving, "name"> & {
    item: DraftItem;
    place: number;
    checked: Schemas["ItemPreview"] | undefined;
    isLast: boolean;
    onSet: () => void;
    onRemove: () => void;
  },
) {
  const { item, place, checked, isLast, onButton, onMove, onSet, onRemove } = props;
  const { recording_name: name } = item;
  const lasts = checked?.duration_s;
  const moving = { name, onButton, onMove };
  return (
    <Table.Tr>
      <Table.Td>{place + 1}</Table.Td>
      <Table.Td>{name}</Table.Td>
      <Table.Td>
        {describePrescription(item)}
        {checked?.problem && (
          <Text fw={600} c="grape.9" role="alert">
            {translateServerText(checked.problem, checked.problem_key)}
          </Text>
        )}
      </Table.Td>
      <Table.Td ta="right">{typeof lasts === "number" ? formatDuration(lasts) : "–"}</Table.Td>
      <Table.Td>
        <Group gap="xs" wrap="nowrap" justify="end">
          <Button
            size="md"
            variant="default"
            aria-label={t("programmes:items.settingsOf", { recording: name })}
            leftSection={<IconAdjustments size={20} />}
            onClick={onSet}
          >
            {t("programmes:items.settings")}
          </Button>
          <MoveButton way="up" disabled={place === 0} {...moving} />
          <MoveButton way="down" disabled={isLast} {...moving} />
          <ActionIcon
            size={44}
            variant="default"
            aria-label={t("programmes:items.remove", { recording: name })}
            onClick={onRemove}
          >
            <IconTrash size={22} />
          </ActionIcon>
        </Group>
      </Table.Td>
    </Table.Tr>
  );
}
