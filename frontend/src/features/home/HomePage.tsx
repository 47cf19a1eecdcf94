import "../fleet/catalogue";
import { Grid, Group, SimpleGrid, Stack, Text, Title } from "@mantine/core";
import { useRouter } from "@tanstack/react-router";
import { useSyncExternalStore } from "react";
import { useTitle } from "../../app/title";
import { formatDayOf } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useDatabaseUnavailable } from "../../lib/offline";
import { HelpLink } from "../../ui/HelpLink";
import { ButtonLink, PageLink } from "../../ui/links";
import { RevealWhenLoaded } from "../../ui/RevealWhenLoaded";
import { useOnTelephone } from "../../ui/useOnTelephone";
import { AlarmFrame } from "../alarms/Alarms";
import { useHasPermission } from "../auth/hooks";
import { StationTile } from "../fleet/StationTile";
import { stations } from "../fleet/store";
import { HomeTiles } from "./HomeTiles";
import classes from "./home.module.css";
import { Worklist } from "./Worklist";

/**
 * The first page. Depending on the user's permissions it shows the work of the day, the state of the stations,
 * and the clinic's key figures. Administrators see the figures first, except on a telephone.
 */
export function HomePage() {
  useTitle(t("home:title"));
  const known = useSyncExternalStore(stations.subscribe, stations.get);
  const canReadRecords = useHasPermission("read_records");
  const canAdminister = useHasPermission("administer");
  const canSeeOperation = useHasPermission("see_operation");
  const databaseUnavailable = useDatabaseUnavailable();
  const router = useRouter();
  // The station's page loads while the user reads this one, so that it opens at once, even without the network. Its
  // files must not delay this page's own requests.
  const preloadStation = () => void router.preloadRoute({ to: "/station" }).catch(() => undefined);
  const figures = (canReadRecords || canSeeOperation) && !databaseUnavailable && <HomeTiles />;
  const onTelephone = useOnTelephone();
  const figuresFirst = !canReadRecords || (canAdminister && !onTelephone);
  return (
    <Stack>
      <Group justify="space-between" align="baseline">
        <Title order={1} size="h2">
          {t("home:title")}
        </Title>
        <Text>{formatDayOf(new Date().toISOString())}</Text>
      </Group>
      {databaseUnavailable && (
        <Group>
          <Text role="status">{t("home:noRecords")}</Text>
          <ButtonLink to="/station">{t("home:goStation")}</ButtonLink>
          <HelpLink topic="database" subject={t("home:noRecords")} />
        </Group>
      )}
      <RevealWhenLoaded
        waits={known.stations === null && !known.lost && !databaseUnavailable}
        onIdle={preloadStation}
      >
        <Stack gap="lg">
          {figuresFirst && figures}
          <Grid gap="lg">
            {canReadRecords && !databaseUnavailable && (
              <Grid.Col span={{ base: 12, lg: 8 }}>
                <Worklist />
              </Grid.Col>
            )}
            <Grid.Col span={{ base: 12, lg: canReadRecords && !databaseUnavailable ? 4 : 12 }}>
              <Stations narrow={canReadRecords && !databaseUnavailable} />
            </Grid.Col>
          </Grid>
          {!figuresFirst && figures}
        </Stack>
      </RevealWhenLoaded>
    </Stack>
  );
}

/** Shows the stations with their emergency stops and remaining times. */
function Stations({ narrow }: { narrow: boolean }) {
  const known = useSyncExternalStore(stations.subscribe, stations.get);
  return (
    <Stack component="section" aria-label={t("home:stations")} gap="sm">
      <Group justify="space-between" align="baseline">
        <Title order={2} size="h4">
          {t("home:stations")}
        </Title>
        <PageLink to="/stations">{t("home:allStations")}</PageLink>
      </Group>
      {known.stations === null && known.lost && (
        <AlarmFrame priority="medium">{t("fleet:stations.lost")}</AlarmFrame>
      )}
      <SimpleGrid cols={{ base: 1, sm: 2, lg: narrow ? 1 : 3 }} className={classes.stations ?? ""}>
        {known.stations?.map((station) => (
          <StationTile key={station.name} station={station} />
        ))}
      </SimpleGrid>
    </Stack>
  );
}
