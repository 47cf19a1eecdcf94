import "./catalogue";
import { Alert, Badge, Card, Group, Progress, Stack, Text, Title } from "@mantine/core";
import { IconAlertTriangle, IconPlugConnectedX } from "@tabler/icons-react";
import type { ReactNode } from "react";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { EstopSign } from "../../safety/EstopBadge";
import { ModeSign } from "../../safety/ModeSign";
import { AlarmFrame } from "../alarms/Alarms";
import {
  describeActivity,
  describeProgress,
  operatedBy,
  type Shown,
  type State,
  silentSince,
} from "./messages";

/** A summary of one station. An unknown state looks different from all known ones. */
export function StationTile({ station, children }: { station: Shown; children?: ReactNode }) {
  const { name, state } = station;
  return (
    <Card
      withBorder
      component="article"
      aria-label={name}
      data-testid="station"
      data-silent={station.silent}
      {...(!state && { bg: "var(--kata-quiet)" })}
    >
      <Stack gap="sm">
        <Group justify="space-between">
          <Title order={2} size="h3">
            {name}
          </Title>
          <Group gap="xs">
            {station.here && <Badge variant="light">{t("fleet:stations.here")}</Badge>}
            {state?.simulated && (
              <Badge variant="outline" color="gray">
                {t("fleet:stations.simulated")}
              </Badge>
            )}
          </Group>
        </Group>
        {station.doubled && (
          <Alert color="grape" role="alert" icon={<IconAlertTriangle />}>
            {t("fleet:stations.duplicateName")}
          </Alert>
        )}
        {state ? (
          <Doing state={state} hidden={station.patient_hidden} />
        ) : (
          <Silent heardAt={station.heard_at} />
        )}
        {children}
      </Stack>
    </Card>
  );
}

function Silent({ heardAt }: { heardAt: string | null }) {
  return (
    <Group gap="sm" wrap="nowrap" role="status">
      <IconPlugConnectedX size={28} aria-hidden />
      <div>
        <Text fw={600}>{t("fleet:stations.silent")}</Text>
        <Text size="sm">{silentSince(heardAt)}</Text>
      </div>
    </Group>
  );
}

function Doing({ state, hidden }: { state: State; hidden: boolean }) {
  const progress = describeProgress(state);
  const alive = state.device === "running";
  return (
    <>
      <Group gap="xs">
        <EstopSign estop={alive ? state.estop : "unknown"} />
        <ModeSign torque={alive ? state.torque : null}>{describeActivity(state)}</ModeSign>
      </Group>
      {state.causes.map((cause) => (
        <AlarmFrame
          key={`${cause.code} ${cause.axis}`}
          priority={cause.cleared && !state.arm_held ? "medium" : "high"}
        >
          {translateServerText(cause.message, cause.message_key)}
        </AlarmFrame>
      ))}
      {state.patient ? (
        <Text fw={600}>{state.patient.name}</Text>
      ) : (
        <Text size="sm" c="dimmed">
          {t(hidden ? "fleet:stations.patientHidden" : "fleet:stations.noPatient")}
        </Text>
      )}
      {state.recording_name && <Text size="sm">{state.recording_name}</Text>}
      {state.progress && (
        <Progress
          value={(100 * state.progress.position_s) / Math.max(state.progress.duration_s, 0.001)}
          aria-label={progress}
        />
      )}
      {progress && <Text size="sm">{progress}</Text>}
      {state.operator && (
        <Text size="sm" c="dimmed">
          {operatedBy(state.operator)}
        </Text>
      )}
    </>
  );
}
