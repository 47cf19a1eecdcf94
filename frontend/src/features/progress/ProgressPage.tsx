import { Stack, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useParams } from "@tanstack/react-router";
import { useTitle } from "../../app/title";
import { api, type Chart } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { PatientBanner } from "../patients/PatientBanner";
import { ProgressChart } from "./ProgressChart";
import classes from "./progress.module.css";

/** The progress of an episode: all charts and their data. */
export function ProgressPage() {
  const { episodeId } = useParams({ from: "/episodes/$episodeId/progress" });
  useTitle(t("progress:progress.title"));
  const episode = useQuery({ queryKey: ["episode", episodeId], queryFn: () => api.episode(episodeId) });
  return (
    <Stack gap="xl">
      <PatientBanner patientId={episode.data?.patient_id} link />
      <div>
        <Title order={1} size="h2">
          {t("progress:progress.title")}
        </Title>
        <Text fw={600}>{episode.data ? t(`episodes:care.shoulder.${episode.data.side}`) : "\u00a0"}</Text>
        <Text>{t("progress:progress.weeks")}</Text>
      </div>
      <div className={classes.charts}>
        {(Object.keys(t("progress:charts", { returnObjects: true })) as Chart[]).map((chart) => (
          <ProgressChart key={chart} episodeId={episodeId} chart={chart} />
        ))}
      </div>
    </Stack>
  );
}
