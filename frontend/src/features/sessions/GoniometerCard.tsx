import { Button, Card, Group, NumberInput, Select, Stack, Table, Text } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Schemas, type Session } from "../../lib/api/client";
import { formatClock, formatDeg } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useSetSessionCache } from "../../lib/useSetSessionCache";
import { ProblemNote } from "../../ui/ProblemNote";
import { ScrolledTable } from "../../ui/ScrolledTable";
import { TitleWithHelp } from "../../ui/TitleWithHelp";
import { undoStore } from "../../ui/undo";
import { useHasPermission } from "../auth/hooks";

const MOTIONS = ["3", "4", "5", "6"] as const;
type Motion = (typeof MOTIONS)[number];
type Reading = Schemas["GoniometerReading"];
/** Range of angles that the service accepts, degrees. */
const ANGLE = { size: "lg", min: -180, max: 210 } as const;

const motionName = ({ motion }: Pick<Reading, "motion">) =>
  t(`sessions:goniometer.motions.${motion as 3 | 4 | 5 | 6}`);

/** The session's goniometer readings, from which the patient's angles are estimated. */
export function GoniometerCard({ session }: { session: Session }) {
  const writes = useHasPermission("write_records") && !session.signed_at;
  const setSessionCache = useSetSessionCache();
  const remove = useMutation({
    mutationFn: ({ id }: Reading) => api.removeGoniometerReading(session.id, id),
    onSuccess: (saved, { motion, patient_deg, apparatus_deg, read_by }) => {
      setSessionCache(saved);
      undoStore.offer({
        words: t(`sessions:goniometer.${session.ended_at ? "removed" : "removedOpen"}`, {
          motion: motionName({ motion }),
          angle: formatDeg(patient_deg),
        }),
        undo: async () =>
          setSessionCache(
            await api.addGoniometerReading(session.id, { motion, patient_deg, apparatus_deg, read_by }),
          ),
      });
    },
  });
  return (
    <Card withBorder component="section" aria-label={t("sessions:goniometer.title")}>
      <Stack>
        <TitleWithHelp order={2} size="h3" topic="session">
          {t("sessions:goniometer.title")}
        </TitleWithHelp>
        <Text>{t("sessions:goniometer.explained")}</Text>
        <Readings readings={session.goniometer_readings ?? []} {...(writes && { onRemove: remove.mutate })} />
        <ProblemNote error={remove.error} />
        {writes && <AddReading session={session} />}
        <Text size="sm">{t("sessions:goniometer.source")}</Text>
      </Stack>
    </Card>
  );
}

function Readings({ readings, onRemove }: { readings: Reading[]; onRemove?: (reading: Reading) => void }) {
  if (readings.length === 0) return <Text>{t("sessions:goniometer.none")}</Text>;
  return (
    <ScrolledTable minWidth={640}>
      <Table withTableBorder verticalSpacing="xs" data-testid="goniometer-readings">
        <Table.Thead>
          <Table.Tr>
            <Table.Th>{t("sessions:goniometer.motion")}</Table.Th>
            <Table.Th>{t("sessions:goniometer.time")}</Table.Th>
            <Table.Th ta="right">{t("sessions:goniometer.apparatus")}</Table.Th>
            <Table.Th ta="right">{t("sessions:goniometer.reading")}</Table.Th>
            <Table.Th>{t("sessions:goniometer.by")}</Table.Th>
            {onRemove && <Table.Th>{t("sessions:goniometer.correct")}</Table.Th>}
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {readings.map((reading) => (
            <Table.Tr key={reading.id}>
              <Table.Td>{motionName(reading)}</Table.Td>
              <Table.Td>{formatClock(new Date(reading.read_at))}</Table.Td>
              <Table.Td ta="right">{formatDeg(reading.apparatus_deg)}</Table.Td>
              <Table.Td ta="right">{formatDeg(reading.patient_deg)}</Table.Td>
              <Table.Td>{reading.read_by}</Table.Td>
              {onRemove && (
                <Table.Td>
                  <Button
                    variant="subtle"
                    aria-label={t("sessions:goniometer.removeNamed", {
                      motion: motionName(reading),
                      angle: formatDeg(reading.patient_deg),
                    })}
                    onClick={() => onRemove(reading)}
                  >
                    {t("sessions:goniometer.remove")}
                  </Button>
                </Table.Td>
              )}
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </ScrolledTable>
  );
}

function AddReading({ session }: { session: Session }) {
  const [motion, setMotion] = useState<Motion>("4");
  const [patient, setPatient] = useState<number | string>("");
  const [apparatus, setApparatus] = useState<number | string>("");
  const setSessionCache = useSetSessionCache();
  const add = useMutation({
    mutationFn: () =>
      api.addGoniometerReading(session.id, {
        motion: Number(motion),
        patient_deg: Number(patient),
        apparatus_deg: apparatus === "" ? null : Number(apparatus),
        read_by: "",
      }),
    onSuccess: (saved) => {
      setPatient("");
      setApparatus("");
      setSessionCache(saved);
    },
  });
  return (
    <>
      <Group align="end">
        <Select
          size="lg"
          label={t("sessions:goniometer.motion")}
          allowDeselect={false}
          data={MOTIONS.map((value) => ({ value, label: t(`sessions:goniometer.motions.${value}`) }))}
          value={motion}
          onChange={(value) => setMotion((value ?? "4") as Motion)}
        />
        <NumberInput
          {...ANGLE}
          label={t("sessions:goniometer.reading")}
          value={patient}
          onChange={setPatient}
        />
        <NumberInput
          {...ANGLE}
          label={t("sessions:goniometer.apparatus")}
          placeholder={session.ended_at ? "" : t("sessions:goniometer.asMeasured")}
          value={apparatus}
          onChange={setApparatus}
        />
        <Button
          size="lg"
          disabled={patient === "" || (session.ended_at !== null && apparatus === "")}
          loading={add.isPending}
          onClick={() => add.mutate()}
        >
          {t("sessions:goniometer.add")}
        </Button>
      </Group>
      <Text size="sm">{t(`sessions:goniometer.${session.ended_at ? "endedHint" : "openHint"}`)}</Text>
      <ProblemNote error={add.error} />
    </>
  );
}
