import { ActionIcon, Tooltip } from "@mantine/core";
import { useHotkeys } from "@mantine/hooks";
import { IconSearch } from "@tabler/icons-react";
import { lazy, useState } from "react";
import { t } from "../../lib/i18n";
import { LazyPart } from "../../ui/LazyPart";
import { MOD } from "./modifier";

const SearchDialog = lazy(() =>
  import("./SearchDialog").then((module) => ({ default: module.SearchDialog })),
);
const ShortcutSheet = lazy(() =>
  import("./ShortcutSheet").then((module) => ({ default: module.ShortcutSheet })),
);

/** Opens the search or the list of shortcuts on every page. Both load on first use. */
export function SearchButton() {
  const [open, setOpen] = useState<"search" | "sheet" | null>(null);
  useHotkeys(
    [
      ["mod+K", () => setOpen("search")],
      ["mod+/", () => setOpen("sheet")],
    ],
    // No tags are ignored, so that the shortcuts also work while the user types.
    [],
  );
  const close = () => setOpen(null);
  return (
    <>
      <Tooltip label={t("search:dialog.tooltip", { key: `${MOD} K` })}>
        <ActionIcon
          variant="subtle"
          color="var(--mantine-color-text)"
          size={44}
          ml="auto"
          aria-label={t("search:dialog.title")}
          aria-keyshortcuts="Control+K Meta+K"
          onClick={() => setOpen("search")}
        >
          <IconSearch size={24} />
        </ActionIcon>
      </Tooltip>
      <LazyPart loading={null}>
        {open === "search" && <SearchDialog opened onClose={close} />}
        {open === "sheet" && <ShortcutSheet opened onClose={close} />}
      </LazyPart>
    </>
  );
}
