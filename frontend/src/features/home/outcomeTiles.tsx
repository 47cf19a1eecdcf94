import { useQuery } from "@tanstack/react-query";
import { api } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { MetricLink } from "../../ui/Metric";
import { describeAdherence } from "../statistics/adherence";
import { spanOf } from "../statistics/figuresSearch";
import { changeOfAll, wholePercent } from "../statistics/outcomeFormat";

/** The period of the page that opens without a choice. */
const PERIOD = { range: "months12" } as const;

export function ImprovedTile() {
  const span = spanOf(PERIOD, new Date());
  const { data, isError } = useQuery({ queryKey: ["outcomes", span], queryFn: () => api.outcomes(span) });
  const change = data && changeOfAll(data, "spadi");
  const share = change?.important;
  const few = data && t("home:tiles.fewPatients", { count: data.least_patients });
  return (
    <MetricLink
      to="/clinic/$subject"
      params={{ subject: "outcomes" }}
      search={PERIOD}
      label={t("home:tiles.improved")}
      value={
        data &&
        (share
          ? t("statistics:figures.percent", { value: wholePercent(share.value) })
          : t("home:tiles.hidden"))
      }
      note={
        change && share
          ? t("home:tiles.improvedDetail", {
              low: wholePercent(share.low),
              high: wholePercent(share.high),
              count: change.shoulders,
              limit_points: data.limits.spadi?.[0] ?? 0,
            })
          : (few ?? "")
      }
      failed={isError}
    />
  );
}

export function AdherenceTile() {
  const { data, isError } = useQuery({ queryKey: ["clinic-adherence"], queryFn: api.clinicAdherence });
  const adherence = data?.adherence;
  const share = adherence && adherence.prescribed > 0 ? adherence.held / adherence.prescribed : null;
  return (
    <MetricLink
      to="/clinic/$subject"
      params={{ subject: "adherence" }}
      label={t("home:tiles.adherence")}
      value={
        data &&
        (share === null || share === undefined
          ? t("home:tiles.hidden")
          : t("statistics:figures.percent", { value: wholePercent(share) }))
      }
      note={
        adherence
          ? describeAdherence(adherence)
          : data
            ? t("home:tiles.fewProgrammes", { count: data.least_programmes })
            : ""
      }
      failed={isError}
    />
  );
}
