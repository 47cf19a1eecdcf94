import "./catalogue";
import { Skeleton, Stack, Text } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useNavigate, useSearch } from "@tanstack/react-router";
import { useTitle } from "../../app/title";
import { api } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { useStation } from "../../lib/live/hooks";
import { PageTabs } from "../../ui/PageTabs";
import { ProblemNote } from "../../ui/ProblemNote";
import { TitleWithHelp } from "../../ui/TitleWithHelp";
import { useHasPermission } from "../auth/hooks";
import { CommissioningState } from "./CommissioningState";
import type { CommissioningTab } from "./commissioningTabs";
import { ProcedureTab } from "./ProcedureTab";
import { RecordsTab } from "./RecordsTab";
import { HistoryTab, SettingsTab } from "./SettingsTab";

const TABS: Record<CommissioningTab, string> = {
  records: t("commissioning:page.records"),
  procedure: t("commissioning:page.procedure"),
  settings: t("commissioning:page.settings"),
  history: t("commissioning:page.history"),
};

/** Shows commissioning records and drift of this station, its configuration, and the history of both. */
export function CommissioningPage() {
  useTitle(t("commissioning:page.title"));
  const station = useStation();
  const canSeeOperation = useHasPermission("see_operation");
  return (
    <Stack>
      <TitleWithHelp order={1} size="h2" topic="commissioning">
        {t("commissioning:page.title")}
      </TitleWithHelp>
      <CommissioningState />
      {canSeeOperation ? (
        station ? (
          <Tabs station={station.name} />
        ) : (
          <Skeleton h={320} />
        )
      ) : (
        <Text>{t("commissioning:page.notAllowed")}</Text>
      )}
    </Stack>
  );
}

function Tabs({ station }: { station: string }) {
  const search = useSearch({ from: "/commissioning" });
  const navigate = useNavigate({ from: "/commissioning" });
  const versions = useQuery({
    queryKey: ["station-versions", station],
    queryFn: () => api.stationVersions(station),
  });
  const items = versions.data?.items ?? [];
  return (
    <PageTabs
      label={t("commissioning:page.tabs")}
      value={search.tab ?? "records"}
      names={TABS}
      onChange={(tab) => void navigate({ search: { tab } })}
    >
      {(tab) => (
        <Stack>
          {tab === "records" && <RecordsTab station={station} />}
          {tab === "procedure" && <ProcedureTab />}
          {(tab === "settings" || tab === "history") && <ProblemNote error={versions.error} />}
          {(tab === "settings" || tab === "history") && versions.isPending && <Skeleton h={320} />}
          {tab === "settings" && items.length > 0 && <SettingsTab station={station} versions={items} />}
          {tab === "history" && items.length > 0 && (
            <HistoryTab versions={items} more={(versions.data?.next ?? null) !== null} />
          )}
        </Stack>
      )}
    </PageTabs>
  );
}
