import { Alert, Text } from "@mantine/core";
import { IconAlertTriangle } from "@tabler/icons-react";
import type { Schemas } from "../../lib/api/client";
import { formatList } from "../../lib/format";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { usePatientBanner } from "./PatientBanner";

type Settings = { speed_percent: number; range_percent: number; repetitions: number };
const NAMES = ["resistance_level", "speed_percent", "range_percent", "repetitions"] as const;

/** Return the settings that exceed the stage's proposal. */
export function exceededSettings(
  proposal: Schemas["StageProposal"],
  settings: Settings,
  resistanceLevel: number | null,
): (typeof NAMES)[number][] {
  const given = { ...settings, resistance_level: resistanceLevel ?? 0 };
  return NAMES.filter((name) => given[name] > proposal[name]);
}

/** Shows the proposal of this shoulder's stage with its source, and warns if settings exceed it. It changes no setting. */
export function StageWarning(props: {
  patientId: string;
  episodeId: string | null;
  settings: Settings;
  resistanceLevel: number | null;
}) {
  const shoulders = usePatientBanner(props.patientId).data?.shoulders ?? [];
  const proposal = shoulders.find(({ episode_id }) => episode_id === props.episodeId)?.proposal;
  if (!proposal) return null;
  const values = {
    level: proposal.resistance_level,
    speed: proposal.speed_percent,
    range: proposal.range_percent,
    repetitions: proposal.repetitions,
  };
  const exceeded = exceededSettings(proposal, props.settings, props.resistanceLevel);
  const stage = t(`episodes:stages.${proposal.stage}`);
  return (
    <div data-testid="stage-proposal">
      <Text size="sm">
        {t("patients:stage.proposes", { stage, ...values })}{" "}
        {translateServerText(proposal.source, proposal.source_key)}
      </Text>
      {exceeded.length > 0 && (
        <Alert color="grape" variant="light" icon={<IconAlertTriangle />} role="status" mt="xs">
          <Text fw={600}>
            {t("patients:stage.exceeded", {
              stage,
              settings: formatList(exceeded.map((name) => t(`patients:stage.settings.${name}`))),
            })}
          </Text>
        </Alert>
      )}
    </div>
  );
}
