import { Button, Group, Select, Stack, Text } from "@mantine/core";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import {
  api,
  type ProgrammeItem,
  type ReadyPatient,
  type Schemas,
  type Session,
} from "../../../lib/api/client";
import { t } from "../../../lib/i18n";
import { useDatabaseUnavailable, withOfflineCopy } from "../../../lib/offline";
import { patientOf, useEpisodes } from "../../../lib/patientQueries";
import { useSetSessionCache } from "../../../lib/useSetSessionCache";
import { ProblemNote } from "../../../ui/ProblemNote";
import { useUserName } from "../../auth/hooks";
import { DoctorsLimits } from "../../episodes/DoctorsLimits";
import { describePrescription, lower } from "../../programmes/describeProgramme";

const NONE = "none";

/** The newest version of a programme. */
type Version = Pick<Schemas["SessionProgramme"], "id" | "name" | "number" | "timer_minutes"> & {
  items: PlannedItem[];
};
/** An item as it is prescribed. Without the database its end-range time is not known. */
type PlannedItem = Omit<Schemas["SessionItem"], "recording_id"> & Partial<Pick<ProgrammeItem, "end_range">>;

async function newestVersions(patientId: string): Promise<Version[]> {
  const { items } = await api.programmes(patientId);
  return items
    .filter((programme) => !programme.archived_at)
    .map(({ name, current }) => ({ name, ...current }));
}

const offlineVersion = ({ programme }: ReadyPatient): Version[] =>
  programme ? [{ ...programme, id: programme.version_id }] : [];

const optionOf = (
  id: string,
  version: Pick<Version, "name" | "number">,
): { value: string; label: string } => ({
  value: id,
  label: t("station:wizard.version", { name: version.name, number: version.number }),
});

/** Starts the session with a programme, or changes the programme of the running session. */
export function BeginStep(props: { patientId: string; session: Session | null; onDone: () => void }) {
  const { patientId, session, onDone } = props;
  const who = useUserName();
  const setSessionCache = useSetSessionCache();
  const databaseUnavailable = useDatabaseUnavailable();
  const programmes = useQuery({
    queryKey: ["programmes", patientId, "to begin by"],
    queryFn: () => withOfflineCopy(patientId, () => newestVersions(patientId), offlineVersion),
  });
  const choices = programmes.data ?? [];
  const planned = session?.programme?.version_id ?? null;
  const [given, setGiven] = useState<string | null>(null);
  // The newest programme is preselected.
  const chosen = given ?? planned ?? (session ? NONE : (choices[0]?.id ?? NONE));
  const version = choices.find(({ id }) => id === chosen);
  const plan = version ?? (chosen === planned ? session?.programme : null) ?? null;
  const options = choices.map((choice) => optionOf(choice.id, choice));
  if (session?.programme && planned && !version && chosen === planned)
    options.push(optionOf(planned, session.programme));
  // Without the database only recordings that were fetched with the programme can be played.
  if (!databaseUnavailable || session) options.push({ value: NONE, label: t("station:wizard.noProgramme") });
  const begin = useMutation({
    mutationFn: () => {
      const programme_version_id = chosen === NONE ? null : chosen;
      if (!session) return api.createSession({ patient_id: patientId, therapist: who, programme_version_id });
      return programme_version_id === planned
        ? Promise.resolve(session)
        : api.updateSession(session.id, { programme_version_id, updated_at: session.updated_at });
    },
    onSuccess: (saved) => {
      setSessionCache(saved);
      onDone();
    },
  });
  return (
    <Stack gap="xs">
      {/* Side by side where there is space, so that a tablet shows the button without scrolling. */}
      <Group align="end">
        <Select
          size="md"
          flex="1 1 16rem"
          label={t("station:wizard.programme")}
          allowDeselect={false}
          data={options}
          value={chosen}
          onChange={setGiven}
        />
        <Button
          size="lg"
          loading={begin.isPending}
          disabled={programmes.isPending}
          onClick={() => begin.mutate()}
        >
          {session ? t("station:wizard.continue") : t("station:wizard.begin")}
        </Button>
      </Group>
      <ProblemNote error={programmes.error ?? begin.error} />
      <LimitsInForce patientId={patientId} session={session} />
      {/* The items are last, so that a long programme pushes neither the button nor the limits off the screen. */}
      {plan && <Plan items={plan.items} timerMinutes={plan.timer_minutes} />}
    </Stack>
  );
}

function Plan({ items, timerMinutes }: { items: PlannedItem[]; timerMinutes: number | null }) {
  return (
    <>
      {items.map((item) => (
        <Text key={item.position} size="sm">
          {t("station:wizard.item", {
            position: item.position,
            name: item.recording_name,
            settings: lower(describePrescription({ ...item, end_range: item.end_range ?? null })),
          })}
        </Text>
      ))}
      {timerMinutes !== null && <Text size="sm">{t("station:wizard.timer", { count: timerMinutes })}</Text>}
    </>
  );
}

/** Shows the doctor's limits of the session's episode, or of the patient's open episode before a session. */
function LimitsInForce({ patientId, session }: { patientId: string; session: Session | null }) {
  const databaseUnavailable = useDatabaseUnavailable();
  const patient = useQuery({ ...patientOf(patientId), enabled: !databaseUnavailable });
  const episodes = useEpisodes(patientId);
  const episodeId = session?.episode_id ?? patient.data?.episode_id;
  const episode = episodes.data?.items.find(({ id }) => id === episodeId);
  if (!episode) return databaseUnavailable ? null : <ProblemNote error={episodes.error} />;
  return <DoctorsLimits episode={episode} size="sm" />;
}
