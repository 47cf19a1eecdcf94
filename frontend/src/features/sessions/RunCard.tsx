import { Card, Stack, Text } from "@mantine/core";
import type { Run } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { EndFeelOfRun } from "../end-feel/lazyEndFeel";
import { RunFigures } from "./RunFigures";
import { describeMissingComparison, RunHeading } from "./RunHeading";
import { worstMotor } from "./sessionResult";

/** Shows one playback: how it went, and its figure. */
export function RunCard({ run, number }: { run: Run; number: number }) {
  return (
    <Card withBorder component="section" aria-label={t("sessions:session.playback", { number })}>
      <Stack gap="xs">
        <RunHeading run={run} number={number} />
        {run.stop && <Text fw={600}>{translateServerText(run.stop.message, run.stop.message_key)}</Text>}
        {run.partial && <Text fw={600}>{t("sessions:compared.partial")}</Text>}
        {run.end_feel && <EndFeelOfRun key={run.id} runId={run.id} />}
        {run.comparison ? (
          <RunFigures
            key={run.id}
            runId={run.id}
            worstMotor={worstMotor(run)}
            clockOffset_s={run.clock_offset_s ?? null}
            length_s={run.rate_hz ? run.comparison.samples / run.rate_hz : null}
          />
        ) : (
          !run.end_feel && <Text>{describeMissingComparison(run)}</Text>
        )}
      </Stack>
    </Card>
  );
}
