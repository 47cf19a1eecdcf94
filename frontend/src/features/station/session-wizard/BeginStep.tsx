import { Button, Group, Select, Stack, Text } from "@mantine/core";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { api, type ReadyPatient, type Schemas, type Session } from "../../../lib/api/client";
import { t } from "../../../lib/i18n";
import { useDatabaseUnavailable, withOfflineCopy } from "../../../lib/offline";
import { useSetSessionCache } from "../../../lib/useSetSessionCache";
import { ProblemNote } from "../../../ui/ProblemNote";
import { useUserName } from "../../auth/hooks";
import { settingsWords } from "../playSettingsModel";

const NONE = "none";

/** A programme's newest version. */
type Choice = { id: string; name: string; number: number; items: SessionItem[] };
type SessionItem = Omit<Schemas["SessionItem"], "recording_id">;

async function choicesOf(patientId: string): Promise<Choice[]> {
  const { items } = await api.programmes(patientId);
  return items.filter((one) => !one.archived_at).map(({ name, current }) => ({ name, ...current }));
}

const keptChoices = ({ programme }: ReadyPatient): Choice[] =>
  programme
    ? [{ id: programme.version_id, name: programme.name, number: programme.number, items: programme.items }]
    : [];

/** Starts the session with a programme, or changes the programme of the running session. */
export function BeginStep(props: { patientId: string; session: Session | null; onDone: () => void }) {
  const { patientId, session, onDone } = props;
  const who = useUserName();
  const keep = useSetSessionCache();
  const away = useDatabaseUnavailable();
  const programmes = useQuery({
    queryKey: ["programmes", patientId, "to begin by"],
    queryFn: () => withOfflineCopy(patientId, () => choicesOf(patientId), keptChoices),
  });
  const choices = programmes.data ?? [];
  const planned = session?.programme?.version_id ?? null;
  const [given, setGiven] = useState<string | null>(null);
  // The newest programme is preselected.
  const chosen = given ?? planned ?? (session ? NONE : (choices[0]?.id ?? NONE));
  const version = choices.find((one) => one.id === chosen);
  const items = version?.items ?? (chosen === planned ? (session?.programme?.items ?? []) : []);
  const begin = useMutation({
    mutationFn: () => {
      const programme_version_id = chosen === NONE ? null : chosen;
      if (!session) return api.createSession({ patient_id: patientId, therapist: who, programme_version_id });
      return programme_version_id === planned
        ? Promise.resolve(session)
        : api.updateSession(session.id, { programme_version_id, updated_at: session.updated_at });
    },
    onSuccess: (saved) => {
      keep(saved);
      onDone();
    },
  });
  return (
    <Stack>
      <Select
        size="lg"
        label={t("station:wizard.programme")}
        allowDeselect={false}
        data={[
          ...choices.map((one) => ({
            value: one.id,
            label: t("station:wizard.version", { name: one.name, number: one.number }),
          })),
          ...(planned && !version && chosen === planned && session?.programme
            ? [
                {
                  value: planned,
                  label: t("station:wizard.version", {
                    name: session.programme.name,
                    number: session.programme.number,
                  }),
                },
              ]
            : []),
          // Without the database only recordings fetched with the programme can be played.
          ...(away && !session ? [] : [{ value: NONE, label: t("station:wizard.noProgramme") }]),
        ]}
        value={chosen}
        onChange={setGiven}
      />
      {items.map((item) => (
        <Text key={item.position}>
          {t("station:wizard.item", {
            position: item.position,
            name: item.recording_name,
            settings: settingsWords(item) ?? t("station:wizard.asTaught"),
          })}
        </Text>
      ))}
      <Group>
        <Button
          size="xl"
          loading={begin.isPending}
          disabled={programmes.isPending}
          onClick={() => begin.mutate()}
        >
          {session ? t("station:wizard.continue") : t("station:wizard.begin")}
        </Button>
      </Group>
      <ProblemNote error={programmes.error ?? begin.error} />
    </Stack>
  );
}
