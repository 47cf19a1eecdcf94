import { Combobox, Modal, Text, TextInput, useCombobox } from "@mantine/core";
import { IconSearch } from "@tabler/icons-react";
import { useNavigate } from "@tanstack/react-router";
import { useEffect, useState } from "react";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import { useMe } from "../auth/hooks";
import { type Result, useSearchResults } from "./searchResults";

/**
 * Finds patients, sessions, recordings, pages and actions. It opens below the header, so that Stop stays
 * reachable.
 */
export function SearchDialog({ opened, onClose }: { opened: boolean; onClose: () => void }) {
  return (
    <Modal opened={opened} onClose={onClose} title={t("search:dialog.title")} size="lg">
      <Search onDone={onClose} />
    </Modal>
  );
}

function Search({ onDone }: { onDone: () => void }) {
  const [typed, setTyped] = useState("");
  const navigate = useNavigate();
  const permissions = useMe()?.permissions ?? [];
  const { groups, searching, error } = useSearchResults(typed, permissions);
  // The list is always open.
  const combobox = useCombobox({ opened: true, onDropdownClose: onDone });
  const results = groups.flatMap((group) => group.results);
  const listed = results.map(({ id }) => id).join();
  // Enter opens the best match.
  // biome-ignore lint/correctness/useExhaustiveDependencies: a new list has a new first entry
  useEffect(() => {
    combobox.selectFirstOption();
  }, [listed]);
  const open = (id: string) => {
    const chosen = results.find((result) => result.id === id);
    if (!chosen) return;
    onDone();
    void navigate(chosen.target);
  };
  return (
    <Combobox store={combobox} onOptionSubmit={open}>
      <Combobox.EventsTarget withExpandedAttribute>
        <TextInput
          data-autofocus
          aria-label={t("search:dialog.title")}
          placeholder={t("search:dialog.placeholder")}
          description={t("search:dialog.hint")}
          leftSection={<IconSearch size={18} />}
          maxLength={100}
          value={typed}
          onChange={(event) => setTyped(event.currentTarget.value)}
        />
      </Combobox.EventsTarget>
      <ProblemNote error={error} />
      <Combobox.Options mt="sm" mih={320} aria-label={t("search:dialog.results")}>
        {groups.map(({ title, results: found }) => (
          <Combobox.Group key={title} label={title}>
            {found.map((result) => (
              <Option key={result.id} result={result} />
            ))}
          </Combobox.Group>
        ))}
        {results.length === 0 && (
          <Combobox.Empty>
            {searching ? t("search:dialog.searching") : t("search:dialog.none")}
          </Combobox.Empty>
        )}
      </Combobox.Options>
    </Combobox>
  );
}

function Option({ result }: { result: Result }) {
  return (
    <Combobox.Option value={result.id} mih={44} style={{ display: "grid", alignContent: "center" }}>
      <Text>{result.words}</Text>
      {result.detail && (
        <Text size="sm" c="dimmed">
          {result.detail}
        </Text>
      )}
    </Combobox.Option>
  );
}
