import { Kbd, Modal, Table, Text } from "@mantine/core";
import { t } from "../../lib/i18n";
import { MOD } from "./modifier";

/**
 * The keys of each shortcut. All need a modifier or a focused element, so that no typed or dictated letter
 * triggers one.
 */
const SHORTCUTS = [
  { name: "search", keys: [MOD, "K"] },
  { name: "sheet", keys: [MOD, "/"] },
  { name: "stop", keys: ["Esc"] },
  { name: "move", keys: ["Enter"] },
  { name: "tabs", keys: ["←", "→"] },
  { name: "next", keys: ["Tab"] },
] as const;

/** All keyboard shortcuts. */
export function ShortcutSheet({ opened, onClose }: { opened: boolean; onClose: () => void }) {
  return (
    <Modal opened={opened} onClose={onClose} title={t("search:shortcuts.title")} size="lg">
      <Table verticalSpacing="sm">
        <Table.Tbody>
          {SHORTCUTS.map(({ name, keys }) => (
            <Table.Tr key={name}>
              <Table.Td style={{ whiteSpace: "nowrap" }}>
                {keys.map((key) => (
                  <Kbd key={key} size="md" mr={4}>
                    {key}
                  </Kbd>
                ))}
              </Table.Td>
              <Table.Td>
                <Text>{t(`search:shortcuts.${name}`)}</Text>
              </Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </Modal>
  );
}
