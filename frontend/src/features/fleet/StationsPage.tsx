import "./catalogue";
import { Code, SimpleGrid, Skeleton, Stack, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useState, useSyncExternalStore } from "react";
import { useTitle } from "../../app/title";
import { api } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import { AlarmFrame } from "../alarms/Alarms";
import { RequirePermission } from "../auth/RequirePermission";
import { describeVersion } from "./messages";
import { StationTile } from "./StationTile";
import { stations } from "./store";

/** All stations of the clinic with their current state. */
export function StationsPage() {
  useTitle(t("fleet:stations.title"));
  const known = useSyncExternalStore(stations.subscribe, stations.get);
  return (
    <Stack>
      <Title order={1} size="h2">
        {t("fleet:stations.title")}
      </Title>
      {known.stations === null && known.lost && (
        <AlarmFrame priority="medium">{t("fleet:stations.lost")}</AlarmFrame>
      )}
      {known.stations === null && !known.lost && (
        <>
          <Text role="status">{t("fleet:stations.connecting")}</Text>
          <Skeleton h={160} />
        </>
      )}
      <SimpleGrid cols={{ base: 1, sm: 2, lg: 3 }}>
        {known.stations?.map((station) => (
          <StationTile key={station.name} station={station}>
            <RequirePermission permission="see_operation">
              <Versions station={station.name} />
            </RequirePermission>
          </StationTile>
        ))}
      </SimpleGrid>
    </Stack>
  );
}

/** The software and configuration history of a station, for administrators. */
function Versions({ station }: { station: string }) {
  const [open, setOpen] = useState(false);
  const versions = useQuery({
    queryKey: ["station-versions", station],
    queryFn: () => api.stationVersions(station),
    enabled: open,
  });
  return (
    <details onToggle={(event) => setOpen(event.currentTarget.open)}>
      <summary>{t("fleet:stations.configuration")}</summary>
      <ProblemNote error={versions.error} />
      {versions.data?.items.map((version) => (
        <div key={version.number}>
          <Text size="sm">{describeVersion(version)}</Text>
          <Code block mah={240} style={{ overflow: "auto" }}>
            {version.config}
          </Code>
        </div>
      ))}
    </details>
  );
}
