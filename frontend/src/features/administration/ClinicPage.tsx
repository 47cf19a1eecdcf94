import "./catalogue";
import {
  Button,
  Card,
  Group,
  Select,
  SimpleGrid,
  Skeleton,
  Stack,
  Text,
  Textarea,
  TextInput,
  Title,
} from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { useTitle } from "../../app/title";
import { api, ProblemError, type Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { replaceData } from "../../lib/replaceData";
import { ProblemNote } from "../../ui/ProblemNote";
import { authStore } from "../auth/authState";

type Profile = Schemas["ClinicProfile"];

const KEY = ["clinic-profile"];
/** The time zones that the browser knows; its list omits UTC. The service checks the chosen name. */
const ZONES = [...new Set([...Intl.supportedValuesOf("timeZone"), "UTC"])];

/** The head of printed reports and the clinic's time zone. */
export function ClinicPage() {
  useTitle(t("administration:clinic.title"));
  const profile = useQuery({ queryKey: KEY, queryFn: api.clinicProfile });
  return (
    <Stack component="section" aria-label={t("administration:clinic.title")}>
      <Title order={2} size="h3">
        {t("administration:clinic.title")}
      </Title>
      <ProblemNote error={profile.error} />
      {profile.isPending && <Skeleton h={420} />}
      {profile.data && <ProfileForm profile={profile.data} />}
    </Stack>
  );
}

function ProfileForm({ profile }: { profile: Profile }) {
  const { name, address, phone, time_zone } = profile;
  const queries = useQueryClient();
  const [draft, setDraft] = useState({ name, address, phone, time_zone });
  const save = useMutation({
    mutationFn: () => api.changeClinicProfile(draft),
    onSuccess: (saved) => {
      replaceData(queries, KEY, saved);
      // Every day is shown in this zone.
      if (saved.time_zone !== profile.time_zone) void authStore.refresh();
    },
  });
  const set = (changed: Partial<typeof draft>) => setDraft({ ...draft, ...changed });
  const errors = save.error instanceof ProblemError ? save.error.fields : {};
  const submit = (event: FormEvent) => {
    event.preventDefault();
    save.mutate();
  };
  return (
    <form onSubmit={submit}>
      <SimpleGrid cols={{ base: 1, md: 2 }}>
        <Stack>
          <Text>{t("administration:clinic.explain")}</Text>
          <TextInput
            label={t("administration:clinic.name")}
            maxLength={200}
            value={draft.name}
            error={errors.name}
            onChange={(event) => set({ name: event.currentTarget.value })}
          />
          <Textarea
            label={t("administration:clinic.address")}
            description={t("administration:clinic.addressHint")}
            autosize
            minRows={3}
            maxLength={1000}
            value={draft.address}
            error={errors.address}
            onChange={(event) => set({ address: event.currentTarget.value })}
          />
          <TextInput
            label={t("administration:clinic.phone")}
            maxLength={50}
            value={draft.phone}
            error={errors.phone}
            onChange={(event) => set({ phone: event.currentTarget.value })}
          />
          <Select
            label={t("administration:clinic.timeZone")}
            description={t("administration:clinic.timeZoneHint")}
            placeholder={t("administration:clinic.noZone")}
            searchable
            allowDeselect={false}
            required
            data={[...new Set([...ZONES, ...(draft.time_zone ? [draft.time_zone] : [])])]}
            value={draft.time_zone || null}
            error={errors.time_zone}
            onChange={(zone) => set({ time_zone: zone ?? "" })}
          />
        </Stack>
        <Preview profile={{ ...profile, ...draft }} />
      </SimpleGrid>
      <Group mt="md">
        <Button type="submit" loading={save.isPending}>
          {t("administration:clinic.save")}
        </Button>
        <Text size="sm">
          {profile.updated_at
            ? t("administration:clinic.changed", {
                who: profile.updated_by,
                when: formatMoment(profile.updated_at),
              })
            : t("administration:clinic.fromSettings")}
        </Text>
        {save.isSuccess && <Text role="status">{t("administration:clinic.saved")}</Text>}
      </Group>
      {save.error && Object.keys(errors).length === 0 && <ProblemNote error={save.error} />}
    </form>
  );
}

/** The letterhead as reports show it, but without the logo. */
function Preview({ profile }: { profile: Profile }) {
  return (
    <Card withBorder component="section" aria-label={t("administration:clinic.preview")}>
      <Stack gap="xs">
        <Title order={3} size="h4">
          {t("administration:clinic.preview")}
        </Title>
        <Text fw={700} translate="no">
          {profile.name}
        </Text>
        <Text style={{ whiteSpace: "pre-line" }} translate="no">
          {[profile.address, profile.phone].filter(Boolean).join("\n")}
        </Text>
        <Text size="sm" c="dimmed">
          {t(profile.has_logo ? "administration:clinic.logo" : "administration:clinic.noLogo")}
        </Text>
      </Stack>
    </Card>
  );
}
