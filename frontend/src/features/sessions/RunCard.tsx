import { Button, Card, Group, Stack, Text } from "@mantine/core";
import { IconDownload, IconTable } from "@tabler/icons-react";
import type { Run } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { ButtonLink } from "../../ui/links";
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
          <>
            <RunFigures
              key={run.id}
              runId={run.id}
              worstMotor={worstMotor(run)}
              clockOffset_s={run.clock_offset_s ?? null}
              length_s={run.rate_hz ? run.comparison.samples / run.rate_hz : null}
            />
            <FigureNumbers runId={run.id} />
          </>
        ) : (
          !run.end_feel && <Text>{describeMissingComparison(run)}</Text>
        )}
      </Stack>
    </Card>
  );
}

/** Links to the samples behind the figure and to the tab with the errors. */
function FigureNumbers({ runId }: { runId: string }) {
  return (
    <Group>
      <Button
        component="a"
        variant="default"
        href={`/api/runs/${runId}/samples.csv`}
        leftSection={<IconDownload size={20} />}
      >
        {t("ui:table.csv")}
      </Button>
      <ButtonLink
        from="/sessions/$sessionId"
        to="."
        search={(before) => ({ ...before, tab: "numbers" as const })}
        variant="default"
        leftSection={<IconTable size={20} />}
      >
        {t("progress:progress.showNumbers")}
      </ButtonLink>
    </Group>
  );
}
