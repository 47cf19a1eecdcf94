import { useQuery } from "@tanstack/react-query";
import { api } from "../../lib/api/client";
import { midnight, today } from "../../lib/days";
import { t } from "../../lib/i18n";
import { MetricLink } from "../../ui/Metric";
import { describeSpan } from "../statistics/figuresSearch";
import { changeOfAll, wholePercent } from "../statistics/outcomeFormat";

/** The outcomes of this year. */
function useOutcomes() {
  const since = midnight(`${today().slice(0, 4)}-01-01`, 0);
  return useQuery({
    queryKey: ["outcomes", since],
    queryFn: () => api.outcomes({ since }),
  });
}

export function ImprovedTile() {
  const { data, isError } = useOutcomes();
  const change = data && changeOfAll(data, "spadi");
  const share = change?.important;
  const few = data && t("home:tiles.fewPatients", { count: data.least_patients });
  return (
    <MetricLink
      to="/clinic/$subject"
      params={{ subject: "outcomes" }}
      search={{ range: "year" }}
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
  const { data, isError } = useOutcomes();
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
          ? t("home:tiles.adherenceDetail", {
              days: describeSpan({ from: adherence.first_day, to: adherence.last_day }),
              held: adherence.held,
              count: adherence.prescribed,
              overdue: adherence.overdue,
              programmes: adherence.programmes,
            })
          : data
            ? t("home:tiles.fewPatients", { count: data.least_patients })
            : ""
      }
      failed={isError}
    />
  );
}
