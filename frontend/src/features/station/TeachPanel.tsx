import { Card, Group, List, SegmentedControl, Stack, Text, TextInput } from "@mantine/core";
import { IconHandGrab, IconPlayerRecordFilled, IconShoe } from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { useEffect, useRef, useState } from "react";
import { api, type Schemas } from "../../lib/api/client";
import { formatDuration } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useAlive, useLive } from "../../lib/live/hooks";
import { store } from "../../lib/live/store";
import { InlineSlot } from "../../ui/InlineSlot";
import { PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { TitleWithHelp } from "../../ui/TitleWithHelp";
import { useUserName } from "../auth/hooks";
import { CommandButton } from "./CommandButton";
import { IDENTIFIERS_NEEDED, type Identifier, IdentityChoice } from "./session-wizard/IdentityChoice";
import { CheckLine, useTeachingChecklist } from "./session-wizard/PreflightChecklist";
import classes from "./station.module.css";

type Fixtures = Schemas["TeachRequest"]["fixtures"];

/** Teaching. Torque is off, the therapist moves the arm, and the pedal records the motion. */
export function TeachPanel({ patientId }: { patientId: string }) {
  const alive = useAlive();
  const teaching = useLive("teaching");
  // The name is state of this component, so that it is kept after the teaching.
  const [name, setName] = useState("");
  const [chosen, setChosen] = useState("arm_fixer_1");
  const saved = useSavedTakes(patientId, teaching?.teaching_id ?? null);
  return (
    <Card withBorder component="section" aria-label={t("station:teach.title")}>
      <Stack>
        <TitleWithHelp order={2} size="h3" topic="teaching">
          {t("station:teach.title")}
        </TitleWithHelp>
        {teaching ? (
          <div className={alive ? "" : "stale"}>
            <Pedal />
            <Group justify="space-between" mt="md">
              <Text size="lg" data-testid="takes">
                {teaching.takes === 0
                  ? t("station:teach.noTakes")
                  : t("station:teach.take", { take: teaching.takes, seconds: teaching.take_s.toFixed(1) })}
              </Text>
              <CommandButton command="finish_teaching" send={api.finishTeaching}>
                {t("station:teach.finish")}
              </CommandButton>
            </Group>
          </div>
        ) : (
          <TeachingSetup
            patientId={patientId}
            name={name}
            onName={setName}
            chosen={chosen}
            onChoose={setChosen}
          />
        )}
        {saved.length > 0 && (
          <List data-testid="saved">
            {saved.map((recording) => (
              <List.Item key={recording.id}>
                <InlineSlot
                  words={(name) =>
                    t("station:teach.saved", { name, lasts: formatDuration(recording.duration_s) })
                  }
                >
                  <PageLink to="/recordings/$recordingId" params={{ recordingId: recording.id }}>
                    {recording.name}
                  </PageLink>
                </InlineSlot>
              </List.Item>
            ))}
          </List>
        )}
      </Stack>
    </Card>
  );
}

/**
 * The name, the fixtures and the checks before teaching. Teaching moves nothing, so one press confirms the
 * checks and starts it. The user cannot confirm checks that the apparatus must detect.
 */
function TeachingSetup(props: {
  patientId: string;
  name: string;
  onName: (name: string) => void;
  chosen: string;
  onChoose: (fixtures: string) => void;
}) {
  const { patientId, name, onName, chosen, onChoose } = props;
  const who = useUserName();
  const apparatusSide = useLive("side");
  const isStopped = useLive("stop") !== null;
  const queries = useQueryClient();
  const fixtures = chosen.split(",") as Fixtures;
  const checklist = useTeachingChecklist(patientId, fixtures);
  const checks = checklist.data?.checks ?? [];
  const side = checks.find(({ check }) => check === "side")?.subject;
  const shown = checks.filter(({ check, given }) => !given || check === "fixtures");
  const [identifiers, setIdentifiers] = useState<Identifier[]>([]);
  const identityOpen = checks.some(({ check, given }) => check === "identity" && !given);
  const toConfirm = checks.filter(
    ({ check, given, detected }) => !given && !detected && check !== "identity",
  );
  const undetected = checks.some(({ given, detected }) => !given && detected);
  return (
    <>
      <FixturesChoice value={chosen} onChange={onChoose} />
      <Stack gap="sm" component="section" aria-label={t("station:teach.checklist")}>
        {shown.map((check) => (
          <CheckLine
            key={check.check}
            check={check}
            below={
              check.check === "identity" &&
              checklist.data && (
                <IdentityChoice
                  patient={checklist.data.patient}
                  chosen={identifiers}
                  onChange={setIdentifiers}
                />
              )
            }
          />
        ))}
      </Stack>
      <ProblemNote error={checklist.error} />
      <TextInput
        size="lg"
        label={t("station:teach.name")}
        placeholder={t("station:teach.unnamed")}
        value={name}
        maxLength={100}
        onChange={(event) => onName(event.currentTarget.value)}
      />
      <CommandButton
        // After the apparatus was turned or stopped, an earlier refusal no longer holds.
        key={`${apparatusSide} ${isStopped}`}
        command="teach"
        leftSection={<IconHandGrab size={26} />}
        disabled={
          checklist.data === undefined ||
          undetected ||
          (identityOpen && identifiers.length < IDENTIFIERS_NEEDED)
        }
        send={async () => {
          try {
            await api.teach({
              patient_id: patientId,
              name: name.trim() || t("station:teach.unnamed"),
              taught_by: who,
              // The checks were made for this side and these fixtures.
              side: side === "left" ? "left" : "right",
              fixtures,
              looked_at: toConfirm.map(({ check }) => check),
              ...(identityOpen && { identifiers }),
            });
          } finally {
            // Turning the apparatus opens the test of the emergency stop again.
            void queries.invalidateQueries({ queryKey: ["session"] });
          }
        }}
      >
        {toConfirm.length === 0
          ? t("station:teach.start")
          : t("station:teach.confirmAndStart", { count: toConfirm.length })}
      </CommandButton>
    </>
  );
}

function FixturesChoice({ value, onChange }: { value: string; onChange: (fixtures: string) => void }) {
  return (
    <SegmentedControl
      size="md"
      aria-label={t("station:teach.fixtures")}
      value={value}
      onChange={onChange}
      data={[
        { value: "arm_fixer_1", label: t("station:teach.fixer1") },
        { value: "arm_fixer_2,elbow_fixer_1", label: t("station:teach.fixer2") },
      ]}
    />
  );
}

/** Shows the recording state in letters that can be read from two metres. */
function Pedal() {
  const pedal = useLive("pedal");
  const teaching = useLive("teaching");
  const recording = teaching?.recording === true;
  const words =
    pedal === "stuck"
      ? t("station:teach.releasePedalFirst")
      : pedal === "unknown"
        ? t("station:teach.noPedal")
        : recording
          ? t("station:teach.recording")
          : t("station:teach.pressPedal");
  return (
    <Group
      className={classes.pedal ?? ""}
      data-recording={recording}
      data-testid="pedal"
      role="status"
      aria-live="assertive"
    >
      {recording ? <IconPlayerRecordFilled size={48} /> : <IconShoe size={48} />}
      <Text fz={28} fw={700}>
        {words}
      </Text>
      {recording && (
        <Text fz={28} ml="auto" ff="monospace">
          {t("station:teach.seconds", { seconds: teaching.take_s.toFixed(1) })}
        </Text>
      )}
    </Group>
  );
}

/** Return the takes of the current or last teaching, as soon as each is saved. */
function useSavedTakes(patientId: string, teachingId: string | null): Schemas["Recording"][] {
  const [takes, setTakes] = useState<Schemas["Recording"][]>([]);
  const shown = useRef<string | null>(null);
  // A new teaching starts a new list.
  useEffect(() => {
    if (!teachingId) return;
    shown.current = teachingId;
    setTakes([]);
  }, [teachingId]);
  useEffect(() => {
    const fetchTakes = async () => {
      if (!shown.current) return;
      const { items } = await api.recordings(patientId);
      const ofTeaching = items.filter(({ teaching_id }) => teaching_id === shown.current);
      setTakes(ofTeaching.sort((one, other) => (one.take ?? 0) - (other.take ?? 0)));
    };
    // Without an answer the list stays as it is until the next take.
    const refresh = () => void fetchTakes().catch(() => undefined);
    const stopSaved = store.onSaved((saved) => {
      if (saved.what === "recording" && saved.patient_id === patientId) refresh();
    });
    const stopReconnected = store.onReconnected(refresh);
    return () => {
      stopSaved();
      stopReconnected();
    };
  }, [patientId]);
  return takes;
}
