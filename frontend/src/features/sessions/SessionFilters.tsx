import { Button, Select, SimpleGrid } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconFilter } from "@tabler/icons-react";
import type { Schemas } from "../../lib/api/client";
import { isDay } from "../../lib/days";
import { t } from "../../lib/i18n";
import { DateField } from "../../ui/DateField";
import { describeStop } from "./describeStop";
import { type Filters, UNSIGNED } from "./sessionFilters";

const named = (values: string[]) => values.map((value) => ({ value, label: value }));

/** Filters of the session list: day, therapist, station, stop cause and unsigned notes. On a telephone they are folded behind a button. */
export function SessionFilters(props: {
  value: Filters;
  choices: Schemas["SessionFilterOptions"] | undefined;
  onChange: (value: Filters) => void;
}) {
  const { value, choices, onChange } = props;
  const [unfolded, fold] = useDisclosure(false);
  const set = (name: keyof Filters, given: string | null) => {
    const { [name]: _, ...others } = value;
    onChange(given ? { ...others, [name]: given } : others);
  };
  const day = (label: string, name: "from" | "to") => (
    <DateField
      label={label}
      value={value[name] ?? ""}
      onChange={(given) => (given === "" || isDay(given)) && set(name, given)}
    />
  );
  const choice = (label: string, name: keyof Filters, data: { value: string; label: string }[]) => {
    const chosen = value[name] ?? null;
    // A filter value in the address is shown even if no session has this value.
    const known = chosen === null || data.some((option) => option.value === chosen);
    return (
      <Select
        label={label}
        placeholder={t("sessions:sessions.any")}
        clearable
        searchable
        data={known ? data : [...data, { value: chosen, label: chosen }]}
        value={chosen}
        onChange={(given) => set(name, given)}
      />
    );
  };
  const stops = (choices?.stops ?? []).map((code) => ({ value: code, label: describeStop(code) }));
  const active = Object.keys(value).length;
  return (
    <>
      <Button
        hiddenFrom="sm"
        variant="default"
        leftSection={<IconFilter size={20} />}
        aria-expanded={unfolded}
        onClick={fold.toggle}
        style={{ alignSelf: "start" }}
      >
        {t("sessions:sessions.filters", { count: active })}
      </Button>
      <SimpleGrid
        cols={{ base: 1, xs: 2, sm: 3, lg: 6 }}
        spacing="sm"
        style={{ alignItems: "end" }}
        {...(!unfolded && { visibleFrom: "sm" })}
      >
        {day(t("sessions:sessions.from"), "from")}
        {day(t("sessions:sessions.to"), "to")}
        {choice(t("sessions:sessions.therapist"), "therapist", named(choices?.therapists ?? []))}
        {choice(t("sessions:sessions.station"), "station", named(choices?.stations ?? []))}
        {choice(t("sessions:sessions.stopCause"), "stop", stops)}
        {choice(t("sessions:sessions.note"), "note", [
          { value: UNSIGNED, label: t("sessions:sessions.notSigned") },
        ])}
        {active > 0 && (
          <Button variant="subtle" onClick={() => onChange({})}>
            {t("sessions:sessions.showAll")}
          </Button>
        )}
      </SimpleGrid>
    </>
  );
}
